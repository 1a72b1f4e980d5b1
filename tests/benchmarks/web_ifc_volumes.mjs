// node web_ifc_volumes.mjs NODE_MODULES MODEL.ifc: net volumes of the walls by web-ifc's own geometry, as JSON, a
// GlobalId each. Openings are taken out of what it gives; meshes are closed, so that signed tetrahedra add up.
import { createRequire } from "node:module";
import { readFileSync } from "node:fs";

const [, , modules, model] = process.argv;
const WebIFC = createRequire(`${modules}/`)("web-ifc");
const api = new WebIFC.IfcAPI();
console.log = () => {}; // its own talk goes to the output otherwise
await api.Init();
const id = api.OpenModel(new Uint8Array(readFileSync(model)), { COORDINATE_TO_ORIGIN: false });

function volume(placed) {
  const geometry = api.GetGeometry(id, placed.geometryExpressID);
  const corners = api.GetVertexArray(geometry.GetVertexData(), geometry.GetVertexDataSize()); // x y z and a normal
  const faces = api.GetIndexArray(geometry.GetIndexData(), geometry.GetIndexDataSize());
  const at = (k) => [corners[6 * k], corners[6 * k + 1], corners[6 * k + 2]];
  const [x, y, z] = at(faces[0] ?? 0);
  let sum = 0;
  for (let k = 0; k < faces.length; k += 3) {
    const [a, b, c] = [0, 1, 2].map((j) => at(faces[k + j])).map((p) => [p[0] - x, p[1] - y, p[2] - z]);
    sum += a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0]) + a[2] * (b[0] * c[1] - b[1] * c[0]);
  }
  const m = placed.flatTransformation;
  const scale = m[0] * (m[5] * m[10] - m[6] * m[9]) - m[4] * (m[1] * m[10] - m[2] * m[9]) + m[8] * (m[1] * m[6] - m[2] * m[5]);
  return Math.abs((sum / 6) * scale);
}

const found = {};
api.StreamAllMeshesWithTypes(id, [WebIFC.IFCWALL, WebIFC.IFCWALLSTANDARDCASE], (mesh) => {
  let sum = 0;
  for (let k = 0; k < mesh.geometries.size(); k++) sum += volume(mesh.geometries.get(k));
  found[api.GetLine(id, mesh.expressID).GlobalId.value] = sum;
});
process.stdout.write(JSON.stringify(found));
