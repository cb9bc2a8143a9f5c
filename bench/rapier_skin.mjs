// Rapier's skin beside Filigree's restore: how far each is from the deformation of every vertex (docs/benchmarks.md).
//   node rapier_skin.mjs FILIGREE PACKAGES PARTICLES MESH...
// PACKAGES: a folder whose node_modules has `filigree` and `@dimforge/rapier3d-compat`. PARTICLES: of Rapier's cage, about.
// MESH: a closed surface. Rapier fills it with tetrahedra of a lattice, and keeps the mesh as a skin inside them. Filigree
// restores the mesh twice: from the same particles, through an embedding, and from its own driver of as many vertices.
import { execFileSync } from "node:child_process";
import { mkdtempSync, readFileSync, rmSync } from "node:fs";
import { createRequire } from "node:module";
import { tmpdir } from "node:os";
import { basename, join } from "node:path";
import { pathToFileURL } from "node:url";

const [program, packages, particles, ...meshes] = process.argv.slice(2);
const from = createRequire(join(packages, "node_modules/"));
const load = (name) => import(pathToFileURL(from.resolve(name)));
const { Model } = await load("filigree");
const { Embedding } = await load("filigree/embedding");
const rapier = await load("@dimforge/rapier3d-compat");
const RAPIER = rapier.default ?? rapier;
await RAPIER.init();
const folder = mkdtempSync(join(tmpdir(), "rapier-skin-"));
const STEP = 1e-6; // seconds: Rapier moves a skin when it steps

/** The mesh of a model, at rest. */
function restOf(model) {
    const count = model.info.driverVertices;
    const identity = new Float32Array(9 * count).map((_, k) => (k % 9 % 4 === 0 ? 1 : 0));
    model.restore(model.driverRest.slice(), { gradients: identity });
    return model.positions.slice();
}

async function strip(mesh, ...options) {
    const path = join(folder, "model.fil");
    execFileSync(program, ["strip", mesh, "-o", path, "--quiet", ...options]);
    return Model.open(readFileSync(path));
}

function boxOf(points) {
    const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
    for (let k = 0; k < points.length; ++k) {
        low[k % 3] = Math.min(low[k % 3], points[k]);
        high[k % 3] = Math.max(high[k % 3], points[k]);
    }
    const size = high.map((x, i) => x - low[i]);
    return { centre: high.map((x, i) => (x + low[i]) / 2), size, diagonal: Math.hypot(...size) };
}

/** The largest cells that give `wanted` particles or more, to 2 %. */
function lattice(points, triangles, wanted, { size }) {
    let small = 0, large = Math.max(...size), best = null;
    for (let tries = 0; tries < 24; ++tries) {
        const cell = small > 0 ? Math.sqrt(small * large) : large / 2;
        const made = RAPIER.SoftBodyDesc.volumetric(points, triangles, cell, true);
        const count = made ? made.numParticles() : 0;
        if (count >= wanted) {
            best = made;
            small = cell;
            if (count <= 1.02 * wanted) break;
        } else {
            large = cell;
        }
        if (count < wanted && small === 0 && large < 1e-3 * Math.max(...size)) break;
    }
    return best;
}

/** The deformations, of points relative to the middle of the box. z: the longest side. */
function deformations({ size, diagonal }) {
    const length = Math.max(...size);
    const waves = [];
    let seed = 12345;
    const random = () => (seed = (Math.imul(seed, 1103515245) + 12345) & 0x7fffffff) / 0x7fffffff;
    for (let w = 0; w < 8; ++w)
        waves.push({
            direction: [0, 1, 2].map(() => (2 * random() - 1) * 2.8 * Math.PI / diagonal),
            move: [0, 1, 2].map(() => (2 * random() - 1) * 0.03 * diagonal),
            phase: 2 * Math.PI * random(),
        });
    const curvature = Math.PI / 2 / length;
    return {
        "bend 90": ([x, y, z]) => [1 / curvature - (1 / curvature - x) * Math.cos(curvature * z), y,
            (1 / curvature - x) * Math.sin(curvature * z)],
        "twist 180": ([x, y, z]) => {
            const c = Math.cos(Math.PI * z / length), s = Math.sin(Math.PI * z / length);
            return [c * x - s * y, s * x + c * y, z];
        },
        "squeeze 2": ([x, y, z]) => { // the waist to half, the ends stay
            const narrow = 0.5 + 0.5 * (2 * z / length) ** 2;
            return [narrow * x, narrow * y, z];
        },
        random: (p) => p.map((x, i) => waves.reduce((sum, { direction, move, phase }) => sum +
            move[i] * Math.sin(direction[0] * p[0] + direction[1] * p[1] + direction[2] * p[2] + phase), x)),
    };
}

function deformed(points, map, { centre, size }) {
    const long = size.indexOf(Math.max(...size)), axes = [(long + 1) % 3, (long + 2) % 3, long];
    const out = new Float32Array(points.length);
    for (let k = 0; k < points.length; k += 3) {
        const moved = map(axes.map((i) => points[k + i] - centre[i]));
        axes.forEach((i, j) => { out[k + i] = moved[j] + centre[i]; });
    }
    return out;
}

/** Of each vertex, as long as the area around it. */
function normalsOf(points, triangles) {
    const normals = new Float64Array(points.length);
    const edge = (a, b) => [0, 1, 2].map((i) => points[3 * b + i] - points[3 * a + i]);
    for (let t = 0; t < triangles.length; t += 3) {
        const u = edge(triangles[t], triangles[t + 1]), v = edge(triangles[t], triangles[t + 2]);
        for (let i = 0; i < 3; ++i) {
            const n = u[(i + 1) % 3] * v[(i + 2) % 3] - u[(i + 2) % 3] * v[(i + 1) % 3];
            for (let c = 0; c < 3; ++c) normals[3 * triangles[t + c] + i] += n;
        }
    }
    return normals;
}

/** rms and largest distance, parts of the diagonal; normals: 95th percentile of the angle, degrees. */
function errorOf(points, exact, triangles, { diagonal }) {
    let sum = 0, largest = 0;
    const mine = normalsOf(points, triangles), right = normalsOf(exact, triangles), angles = [];
    for (let k = 0; k < points.length; k += 3) {
        const d = (points[k] - exact[k]) ** 2 + (points[k + 1] - exact[k + 1]) ** 2 + (points[k + 2] - exact[k + 2]) ** 2;
        sum += d;
        largest = Math.max(largest, d);
        const dot = mine[k] * right[k] + mine[k + 1] * right[k + 1] + mine[k + 2] * right[k + 2];
        const lengths = Math.hypot(mine[k], mine[k + 1], mine[k + 2]) * Math.hypot(right[k], right[k + 1], right[k + 2]);
        if (lengths > 0) angles.push(Math.acos(Math.min(1, Math.max(-1, dot / lengths))) * 180 / Math.PI);
    }
    angles.sort((a, b) => a - b);
    return { rms: Math.sqrt(sum / (points.length / 3)) / diagonal, largest: Math.sqrt(largest) / diagonal,
        normals: angles[Math.floor(0.95 * (angles.length - 1))] };
}

/** Rapier's skin with its particles where `map` takes them. */
function rapierSkin(points, triangles, box, wanted) {
    const description = lattice(points, triangles, wanted, box);
    if (!description) return null;
    description.setSkinCollision(false);
    const world = new RAPIER.World({ x: 0, y: 0, z: 0 });
    world.timestep = STEP;
    const body = world.createSoftBody(description);
    const rest = body.particlePositions().slice();
    let skin = 0;
    while (!body.isMeshSkinned(skin)) ++skin;
    for (let i = 0; i < body.numParticles(); ++i) body.setParticlePinned(i, true);
    return {
        body, rest,
        at(map) {
            const pose = deformed(rest, map, box);
            for (let i = 0; i < body.numParticles(); ++i)
                body.setParticlePosition(i, { x: pose[3 * i], y: pose[3 * i + 1], z: pose[3 * i + 2] });
            world.step();
            return body.meshVertices(skin).slice();
        },
    };
}

const cell = ({ rms, largest, normals }) => `${rms.toExponential(1)}, ${largest.toExponential(1)}, ${normals.toPrecision(2)}`;

console.log("rms, largest error, normals (degrees)\n");
console.log("| mesh | deformation | Rapier's skin | Filigree, Rapier's particles | Filigree, own driver " +
    "| skin / same particles | skin / own driver |");
console.log("|---|---|---|---|---|---|---|");
try {
    for (const mesh of meshes) {
        let own = await strip(mesh, "--base", particles);
        let points = restOf(own);
        const box = boxOf(points), triangles = own.triangles.slice();
        const skin = rapierSkin(points, triangles, box, Number(particles));
        if (!skin) {
            console.error(`rapier_skin: Rapier makes no body of ${mesh}: is it closed?`);
            continue;
        }
        const count = skin.body.numParticles();
        own = await strip(mesh, "--base", String(count));
        points = restOf(own);
        const embedding = new Embedding(own.driverRest, skin.rest, { cells: skin.body.cells() });
        let name = `${basename(mesh)}, ${points.length / 3} on ${count}`;
        for (const [title, map] of Object.entries(deformations(box))) {
            const exact = deformed(points, map, box);
            const error = (restored) => errorOf(restored, exact, triangles, box);
            const theirs = error(skin.at(map));
            const { positions, gradients } = embedding.follow(deformed(skin.rest, map, box));
            const same = error(own.restore(positions, { gradients }).positions);
            const ours = error(own.restore(deformed(own.driverRest, map, box)).positions);
            const ratios = (mine) => ["rms", "largest", "normals"].map((what) => (theirs[what] / mine[what]).toPrecision(2));
            console.log(`| ${name} | ${title} | ${cell(theirs)} | ${cell(same)} | ${cell(ours)} | ` +
                `${ratios(same).join(", ")} | ${ratios(ours).join(", ")} |`);
            name = "";
        }
    }
} finally {
    rmSync(folder, { recursive: true });
}
