// Moves a model's driver with a simulator's points: the particles of a lattice, the nodes of tetrahedra. They lie around the
// driver, in any order and number. Each driver vertex follows the smoothest deformation of space that takes the points
// near it to where they are: a sum of kernels r^3 and quadratic polynomials [Duchon 1977]. Linear weights inside a
// tetrahedron, as in a skin, would lose what bends.
const NEAR = 40; // points that a driver vertex follows
const POLYNOMIALS = 10;
const SMALLEST_PIVOT = 1e-9;

/** The numbers of the `count` points nearest to p, of those in `among` (all where it is null). Ties: the lower number. */
function nearest(points, p, count, among) {
    const squared = (k) => (points[3 * k] - p[0]) ** 2 + (points[3 * k + 1] - p[1]) ** 2 + (points[3 * k + 2] - p[2]) ** 2;
    const found = []; // ascending
    const candidates = among ? among.length : points.length / 3;
    for (let c = 0; c < candidates; ++c) {
        const k = among ? among[c] : c, d = squared(k);
        if (found.length === count && d >= found[count - 1].d) continue;
        let at = found.length < count ? found.length : count - 1;
        for (; at > 0 && found[at - 1].d > d; --at) found[at] = found[at - 1];
        found[at] = { k, d };
    }
    return found.map(({ k }) => k);
}

/** For each point the points that share a cell with it. */
function neighbours(count, cells, corners) {
    const around = Array.from({ length: count }, () => new Set());
    for (let c = 0; c < cells.length; c += corners)
        for (let i = 0; i < corners; ++i) for (let j = 0; j < corners; ++j) if (i !== j) around[cells[c + i]].add(cells[c + j]);
    return around;
}

/** Points over cells from `start` on, ring after ring, until there are enough. */
function connected(start, around, wanted) {
    const seen = new Set([start]);
    for (let ring = [start]; ring.length > 0 && seen.size < wanted;) {
        const next = [];
        for (const point of ring)
            for (const other of around[point])
                if (!seen.has(other)) {
                    seen.add(other);
                    next.push(other);
                }
        ring = next;
    }
    return [...seen].sort((a, b) => a - b);
}

function swapRows(matrix, width, r, s) {
    for (let c = 0; c < width; ++c) {
        const kept = matrix[r * width + c];
        matrix[r * width + c] = matrix[s * width + c];
        matrix[s * width + c] = kept;
    }
}

/** Solves a x = b for the columns of b; both by rows, overwritten. False: singular. */
function solve(a, b, size, columns) {
    for (let k = 0; k < size; ++k) {
        let best = k;
        for (let r = k + 1; r < size; ++r) if (Math.abs(a[r * size + k]) > Math.abs(a[best * size + k])) best = r;
        if (!(Math.abs(a[best * size + k]) > SMALLEST_PIVOT)) return false;
        if (best !== k) {
            swapRows(a, size, k, best);
            swapRows(b, columns, k, best);
        }
        for (let r = k + 1; r < size; ++r) {
            const factor = a[r * size + k] / a[k * size + k];
            if (factor === 0) continue;
            for (let c = k + 1; c < size; ++c) a[r * size + c] -= factor * a[k * size + c];
            for (let c = 0; c < columns; ++c) b[r * columns + c] -= factor * b[k * columns + c];
        }
    }
    for (let k = size - 1; k >= 0; --k)
        for (let c = 0; c < columns; ++c) {
            let sum = b[k * columns + c];
            for (let j = k + 1; j < size; ++j) sum -= a[k * size + j] * b[j * columns + c];
            b[k * columns + c] = sum / a[k * size + k];
        }
    return true;
}

const length = (x, y, z) => Math.sqrt(x * x + y * y + z * z); // hypot is many times slower
const polynomials = ([x, y, z]) => [1, x, y, z, x * x, y * y, z * z, x * y, y * z, z * x];

export class Embedding {
    #near; // points of each driver vertex
    #weights; // of each: for the position, and for the gradient's three columns
    #pointCount;

    /**
     * driver, points: 3 numbers each, at rest. cells: numbers of points, `corners` a cell: then a driver vertex follows
     * only points that are connected with the nearest one, not those of another limb that is close.
     */
    constructor(driver, points, { cells = null, corners = 4 } = {}) {
        const count = driver.length / 3;
        this.#pointCount = points.length / 3;
        if (this.#pointCount < NEAR) throw new Error(`An embedding needs ${NEAR} points or more.`);
        /** Where `follow` leaves its results: 3 and 9 numbers a driver vertex. */
        this.positions = new Float32Array(3 * count);
        this.gradients = new Float32Array(9 * count);
        this.#near = new Uint32Array(NEAR * count);
        this.#weights = new Float64Array(4 * NEAR * count);
        const around = cells ? neighbours(this.#pointCount, cells, corners) : null;
        for (let v = 0; v < count; ++v) {
            const place = driver.subarray(3 * v, 3 * v + 3);
            const among = around ? connected(nearest(points, place, 1, null)[0], around, 4 * NEAR) : null;
            const near = nearest(points, place, NEAR, among);
            if (near.length < NEAR) throw new Error(`A connected part has fewer than ${NEAR} points.`);
            this.#near.set(near, NEAR * v);
            this.#weights.set(weightsAt(points, place, near), 4 * NEAR * v);
        }
    }

    /** Moves the driver to where the points are: then read `positions` and `gradients`. points: as many as at rest. */
    follow(points) {
        if (points.length !== 3 * this.#pointCount)
            throw new Error(`The embedding has ${this.#pointCount} points, and ${points.length / 3} are given.`);
        const weights = this.#weights, near = this.#near, { positions, gradients } = this;
        for (let v = 0; v < positions.length / 3; ++v) {
            const first = 3 * near[NEAR * v], x0 = points[first], y0 = points[first + 1], z0 = points[first + 2];
            let x = 0, y = 0, z = 0, ax = 0, ay = 0, az = 0, bx = 0, by = 0, bz = 0, cx = 0, cy = 0, cz = 0;
            for (let j = 1; j < NEAR; ++j) { // differences: a body far from the origin keeps its digits
                const k = 3 * near[NEAR * v + j], w = 4 * (NEAR * v + j);
                const dx = points[k] - x0, dy = points[k + 1] - y0, dz = points[k + 2] - z0;
                const place = weights[w], a = weights[w + 1], b = weights[w + 2], c = weights[w + 3];
                x += place * dx, y += place * dy, z += place * dz;
                ax += a * dx, ay += a * dy, az += a * dz;
                bx += b * dx, by += b * dy, bz += b * dz;
                cx += c * dx, cy += c * dy, cz += c * dz;
            }
            positions[3 * v] = x0 + x, positions[3 * v + 1] = y0 + y, positions[3 * v + 2] = z0 + z;
            const g = 9 * v;
            gradients[g] = ax, gradients[g + 1] = ay, gradients[g + 2] = az;
            gradients[g + 3] = bx, gradients[g + 4] = by, gradients[g + 5] = bz;
            gradients[g + 6] = cx, gradients[g + 7] = cy, gradients[g + 8] = cz;
        }
        return this;
    }
}

/** Of each near point: its weight in the position at `place`, and in the gradient's columns. */
function weightsAt(points, place, near) {
    const local = near.map((k) => [0, 1, 2].map((i) => points[3 * k + i] - place[i]));
    const scale = Math.max(...local.map((p) => length(...p)));
    if (!(scale > 0)) throw new Error("The points of an embedding all lie at one place.");
    for (const p of local) for (let i = 0; i < 3; ++i) p[i] /= scale;
    const size = NEAR + POLYNOMIALS, columns = 4;
    const matrix = new Float64Array(size * size), right = new Float64Array(size * columns);
    for (let r = 0; r < NEAR; ++r) {
        for (let c = 0; c < NEAR; ++c)
            matrix[r * size + c] = length(local[r][0] - local[c][0], local[r][1] - local[c][1], local[r][2] - local[c][2]) ** 3;
        polynomials(local[r]).forEach((value, t) => {
            matrix[r * size + NEAR + t] = matrix[(NEAR + t) * size + r] = value;
        });
        const distance = length(...local[r]);
        right[r * columns] = distance ** 3;
        for (let i = 0; i < 3; ++i) right[r * columns + 1 + i] = -3 * distance * local[r][i];
    }
    right[NEAR * columns] = 1; // the polynomials at the place, and their derivatives
    for (let i = 0; i < 3; ++i) right[(NEAR + 1 + i) * columns + 1 + i] = 1;
    if (!solve(matrix, right, size, columns))
        throw new Error("The points of an embedding have to fill space: those near a driver vertex lie on one surface.");
    const weights = new Float64Array(4 * NEAR);
    for (let j = 0; j < NEAR; ++j)
        for (let c = 0; c < 4; ++c) weights[4 * j + c] = right[j * columns + c] / (c > 0 ? scale : 1);
    return weights;
}
