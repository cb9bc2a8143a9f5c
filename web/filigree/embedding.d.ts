/** Moves a model's driver with a simulator's points around it, such as the particles of a lattice of tetrahedra. */
export class Embedding {
    /**
     * driver: 3 numbers a driver vertex. points: 3 numbers a point, 40 points or more that fill space. Both at rest.
     * cells: numbers of points, `corners` for each cell (default 4); without them, points of another limb that is
     * close are followed too. Throws Error where points are too few or lie on one surface.
     * Cost: a search among all points, and a system of 50 equations, for each driver vertex.
     */
    constructor(driver: Float32Array, points: Float32Array, options?: { cells?: Uint32Array | null; corners?: number });
    /** Where `follow` leaves the driver: 3 and 9 numbers a driver vertex, as Model.restore takes them. */
    readonly positions: Float32Array;
    readonly gradients: Float32Array;
    /** points: as many as at rest, where they are now. Throws Error for another number. */
    follow(points: Float32Array): this;
}
