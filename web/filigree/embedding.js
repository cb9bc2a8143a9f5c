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

/** Solves a x = b for the columns of b; both by rows, overwritten. False: singular. */
function solve(a, b, size, columns) {
    for (let k = 0; k < size; ++k) {
        let best = k;
        for (let r = k + 1; r < size; ++r) if (Math.abs(a[r * size + k]) > Math.abs(a[best * size + k])) best = r;
        if (!(Math.abs(a[best * size + k]) > SMALLEST_PIVOT)) return false;
        if (best !== k) {
            for (let c = k; c < size; ++c) [a[k * size + c], a[best * size + c]] = [a[best * size + c], a[k * size + c]];
            for (let c = 0; c < columns; ++c)
                [b[k * columns + c], b[best * columns + c]] = [b[best * columns + c], b[k * columns + c]];
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
        const weights = this.#weights;
        for (let v = 0; v < this.positions.length / 3; ++v) {
            const first = points.subarray(3 * this.#near[NEAR * v], 3 * this.#near[NEAR * v] + 3);
            const sums = new Float64Array(12);
            for (let j = 0; j < NEAR; ++j) {
                const k = 3 * this.#near[NEAR * v + j], w = 4 * (NEAR * v + j);
                for (let i = 0; i < 3; ++i) { // differences: a body far from the origin keeps its digits
                    const moved = points[k + i] - first[i];
                    for (let c = 0; c < 4; ++c) sums[3 * c + i] += weights[w + c] * moved;
                }
            }
            for (let i = 0; i < 3; ++i) this.positions[3 * v + i] = first[i] + sums[i];
            for (let i = 0; i < 9; ++i) this.gradients[9 * v + i] = sums[3 + i];
        }
        return this;
    }
}

/** Of each near point: its weight in the position at `place`, and in the gradient's columns. */
function weightsAt(points, place, near) {
    const local = near.map((k) => [0, 1, 2].map((i) => points[3 * k + i] - place[i]));
    const scale = Math.max(...local.map((p) => Math.hypot(...p)));
    if (!(scale > 0)) throw new Error("The points of an embedding all lie at one place.");
    for (const p of local) for (let i = 0; i < 3; ++i) p[i] /= scale;
    const size = NEAR + POLYNOMIALS, columns = 4;
    const matrix = new Float64Array(size * size), right = new Float64Array(size * columns);
    for (let r = 0; r < NEAR; ++r) {
        for (let c = 0; c < NEAR; ++c)
            matrix[r * size + c] = Math.hypot(local[r][0] - local[c][0], local[r][1] - local[c][1], local[r][2] - local[c][2]) ** 3;
        polynomials(local[r]).forEach((value, t) => {
            matrix[r * size + NEAR + t] = matrix[(NEAR + t) * size + r] = value;
        });
        const distance = Math.hypot(...local[r]);
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
