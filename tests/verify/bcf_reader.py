"""A second reader of BCF, in Node: the module @parametricos/bcf-js, found by NODE_PATH."""

from __future__ import annotations

import json
import shutil
import subprocess
from functools import cache
from pathlib import Path
from typing import Any

MODULE = "@parametricos/bcf-js"
SCRIPT = """
const {BcfReader} = require(%s);
const reader = new BcfReader();
reader.read(require("fs").readFileSync(process.argv[1])).then(() => {
  const told = reader.project.markups.map(m => ({
    title: m.topic.title,
    selected: (m.viewpoints[0].components.selection || []).map(c => c.ifc_guid),
    camera: m.viewpoints[0].perspective_camera,
    snapshot: m.viewpoints[0].snapshot,
  }));
  console.log(JSON.stringify(told));
});
"""


@cache
def reads_bcf() -> bool:
    """Whether the reader is there."""
    node = shutil.which("node")
    if node is None:
        return False
    done = subprocess.run([node, "-e", f"require.resolve({json.dumps(MODULE)})"], check=False, capture_output=True)
    return done.returncode == 0


def read_bcf(path: Path) -> list[dict[str, Any]]:
    """Title, selected GlobalIds, camera and snapshot's name of each topic."""
    command = ["node", "-e", SCRIPT % json.dumps(MODULE), str(path)]
    done = subprocess.run(command, check=True, capture_output=True, text=True, timeout=60)
    return json.loads(done.stdout)
