"""A headless Chromium that runs a script in a page and gives what it returns."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from html import unescape
from pathlib import Path
from typing import Any

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome")


def chromium() -> str | None:
    """The program's path, None where there is none."""
    return next((found for name in NAMES if (found := shutil.which(name))), None)


def answer(page: Path, script: str, folder: Path) -> dict[str, Any]:
    """What a script's last ``return`` gives in a copy of the page, and under "errors" what the page complained of."""
    probe = (
        "<script>window.wrong=[];addEventListener('error',e=>wrong.push(e.message));</script>@PAGE@"
        "<pre id='answer'></pre><script>{const a=(()=>{"
        + script
        + "})();document.getElementById('answer').textContent=JSON.stringify({...a,errors:window.wrong})}</script>"
    )
    copy = folder / "probed.html"
    copy.write_text(probe.replace("@PAGE@", page.read_text(encoding="utf-8")), encoding="utf-8")
    dom = run(copy, folder, "--virtual-time-budget=4000", "--dump-dom")
    found = re.search(r'<pre id="answer">(.*?)</pre>', dom, re.DOTALL)
    assert found is not None, dom[-2000:]
    return json.loads(unescape(found[1]))


def run(page: Path, folder: Path, *options: str) -> str:
    """What Chromium prints of a page."""
    command = [str(chromium()), "--headless", "--no-sandbox", "--disable-gpu", f"--user-data-dir={folder / 'profile'}"]
    done = subprocess.run(
        [*command, *options, page.as_uri()], check=True, capture_output=True, text=True, timeout=120, errors="replace"
    )
    return done.stdout
