// MuJoCo moves a flex, the runtime restores the detail: a soft shell falls onto the ground.
//   npm install filigree @mujoco/mujoco
//   node mujoco_flex.mjs MODEL.fil
// The flex is made of the driver's own vertices and triangles, so flexvert_xpos is the driver.
import { Model } from "filigree";
import loadMujoco from "@mujoco/mujoco";
import { readFileSync } from "node:fs";

const model = await Model.open(readFileSync(process.argv[2]), { normals: false });
const mujoco = await loadMujoco();
const numbers = (array) => Array.from(array).join(" ");
const scene = mujoco.MjModel.from_xml_string(`<mujoco>
  <option timestep="0.002" solver="CG" tolerance="1e-6"/>
  <worldbody>
    <geom type="plane" size="10 10 1"/>
    <flexcomp name="driver" type="direct" dim="2" pos="0 0 1.2" mass="1" radius="0.01"
        point="${numbers(model.driverRest)}" element="${numbers(model.driverTriangles)}">
      <edge equality="true" damping="0.1"/>
      <contact selfcollide="none" internal="false"/>
    </flexcomp>
  </worldbody>
</mujoco>`);
const data = new mujoco.MjData(scene);

let lowest = 0;
for (let frame = 0; frame < 60; ++frame) {
    for (let step = 0; step < 8; ++step) mujoco.mj_step(scene, data);
    model.restore(Float32Array.from(data.flexvert_xpos)); // your simulator's arrays in; model.positions: vertices out
    lowest = model.positions.reduce((low, z, k) => (k % 3 === 2 ? Math.min(low, z) : low), Infinity);
}
console.log(`${model.info.vertices} vertices followed ${scene.nflexvert} nodes; ` +
    `the lowest is ${lowest.toFixed(3)} above the ground`);
if (!(lowest > -0.1 && lowest < 0.2)) process.exit(1); // it lies on the ground
