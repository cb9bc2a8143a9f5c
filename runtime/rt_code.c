#include "rt_code.h"

#include "rt_clip.h"
#include "rt_symbols.h"

#include <math.h>
#include <string.h>

#if FLG_HAS_PACKED

/* ---- Symbols, read or written ---- */

typedef struct flg_coder {
    flg_symbols in;
    flg_shares* shares;
#ifdef FLG_WITH_WRITER
    const flg_code_source* out; /* NULL: it reads */
#endif
} flg_coder;

/* Each gives the value that is read, or writes `value`. */
FLG_APART uint32_t code_symbol(flg_coder* c, uint32_t context, uint32_t value) {
#ifdef FLG_WITH_WRITER
    if (c->out) {
        c->out->symbol(c->out->user, context, value);
        return value;
    }
#endif
    (void)value;
    return flg_read_symbol(&c->in, c->shares + context);
}
FLG_APART uint32_t code_number(flg_coder* c, uint32_t context, uint32_t value) {
#ifdef FLG_WITH_WRITER
    if (c->out) {
        c->out->number(c->out->user, context, value);
        return value;
    }
#endif
    (void)value;
    return flg_read_number(&c->in, c->shares + context);
}
FLG_APART uint32_t code_bits(flg_coder* c, uint32_t value, uint32_t count) {
#ifdef FLG_WITH_WRITER
    if (c->out) {
        c->out->bits(c->out->user, value, count);
        return value;
    }
#endif
    (void)value;
    return flg_read_bits(&c->in, count);
}
/* value: what is to be added to what is expected, as an unsigned number that wraps around. */
FLG_INLINE uint32_t code_difference(flg_coder* c, uint32_t context, uint32_t value) {
    return (uint32_t)flg_with_sign(code_number(c, context, flg_without_sign((int32_t)value)));
}
FLG_INLINE int is_writing(const flg_coder* c) {
#ifdef FLG_WITH_WRITER
    return c->out != NULL;
#else
    (void)c;
    return 0;
#endif
}

/* ---- Which point of a driver's triangle is closest ---- */

typedef struct flg_plane {
    double corner[3], edge[2][3]; /* of corner 0, and from it to corners 1 and 2 */
    double aa, ab, bb, inverse;   /* products of the edges; inverse: 0 where there is no area */
    uint32_t beside[3];           /* cells across the edges that u < 0, v < 0 and 1 - u - v < 0 lie behind, or none */
} flg_plane;

typedef struct flg_spot {
    double u, v, squared;
    uint32_t behind; /* 3: inside */
} flg_spot;

static FLG_COLD void measure_plane(flg_plane* plane) {
    double area;
    plane->aa = plane->ab = plane->bb = 0;
    for (int k = 0; k < 3; ++k) {
        plane->aa += plane->edge[0][k] * plane->edge[0][k];
        plane->ab += plane->edge[0][k] * plane->edge[1][k];
        plane->bb += plane->edge[1][k] * plane->edge[1][k];
    }
    area = plane->aa * plane->bb - plane->ab * plane->ab;
    plane->inverse = area > 0 && 1 / area <= DBL_MAX ? 1 / area : 0;
}

static double squared_from(const flg_plane* plane, const double d[3], double u, double v) {
    double squared = 0;
    for (int k = 0; k < 3; ++k) {
        const double x = d[k] - (u * plane->edge[0][k] + v * plane->edge[1][k]);
        squared += x * x;
    }
    return squared;
}

static double share_of(double product, double length) {
    const double t = length > 0 ? product / length : 0;
    return t > 0 ? (t < 1 ? t : 1) : 0;
}

static flg_spot closest_spot(const flg_plane* plane, const float* point) {
    double d[3], x, y, u, v, best_u[3], best_v[3];
    flg_spot spot;
    for (int k = 0; k < 3; ++k) d[k] = (double)point[k] - plane->corner[k];
    x = d[0] * plane->edge[0][0] + (d[1] * plane->edge[0][1] + d[2] * plane->edge[0][2]);
    y = d[0] * plane->edge[1][0] + (d[1] * plane->edge[1][1] + d[2] * plane->edge[1][2]);
    u = plane->inverse * (plane->bb * x - plane->ab * y);
    v = plane->inverse * (plane->aa * y - plane->ab * x);
    spot.behind = 3;
    if (plane->inverse > 0 && u >= 0 && v >= 0 && u + v <= 1) {
        spot.u = u;
        spot.v = v;
        spot.squared = squared_from(plane, d, u, v);
        return spot;
    }
    if (u < 0) spot.behind = 0;
    if (v < 0 && v <= u) spot.behind = 1;
    if (1 - u - v < 0 && 1 - u - v <= u && 1 - u - v <= v) spot.behind = 2;
    best_u[0] = 0;
    best_v[0] = share_of(y, plane->bb);
    best_u[1] = share_of(x, plane->aa);
    best_v[1] = 0;
    {
        const double length = plane->aa + plane->bb - 2 * plane->ab;
        best_v[2] = share_of(y - x + plane->aa - plane->ab, length);
        best_u[2] = 1 - best_v[2];
    }
    spot.squared = -1;
    for (int k = 0; k < 3; ++k) {
        const double squared = squared_from(plane, d, best_u[k], best_v[k]);
        if (spot.squared >= 0 && !(squared < spot.squared)) continue;
        spot.u = best_u[k];
        spot.v = best_v[k];
        spot.squared = squared;
    }
    return spot;
}

#ifdef FLG_WITH_WRITER
static double distance_on(const flg_plane* plane, double u, double v) {
    const double none[3] = {0, 0, 0};
    return sqrt(squared_from(plane, none, u, v));
}
#endif

/* ---- The walk over a mesh ---- */

/* An edge of a known face whose other side is not known yet. Edges stand in rings around what is known. */
typedef struct flg_edge {
    uint32_t from, to;      /* as the face has it; from: none where the other side became known */
    uint32_t before, after; /* the face's corners beside them */
    uint32_t left, right;   /* the ring's edges that end at `from` and begin at `to`, or none */
    uint32_t next;          /* in the queue, or among free edges */
} flg_edge;

enum {
    MEETS_NEW = 0,
    MEETS_LEFT = 1,
    MEETS_RIGHT = 2,
    MEETS_OLD = 3,
    MEETS_DRIVER = 4,
    MEETS_NOTHING = 5,
    /* contexts */
    AROUND = 8, /* faces that are counted around a vertex */
    FIRST_CORNER = 0,
    LATER_CORNER = AROUND * AROUND,
    DEGREE = LATER_CORNER + 2,
    SEED = DEGREE + 1,
    SIZES = 12, /* of differences */
    PLACE = SEED + 1,
    FAR_PLACE = PLACE + 3 * SIZES,
    CELL = FAR_PLACE + 3,
    WEIGHT = CELL + 2,
    MESH_CONTEXTS = WEIGHT + 2,
    VALUE_CONTEXTS = 64,
    FARTHEST = 1 << 28 /* steps */
};

typedef struct flg_walk {
    flg_coder coder;
    const flg_code_input* memory;
    flg_status status;
    const flg_code_sizes* sizes;
    /* the surface at hand: the driver's, then the mesh's */
    int is_driver;
    uint32_t vertices, faces, corner_count, face_size;
    uint32_t *corners, *offsets; /* offsets: NULL where faces have one size */
    uint32_t* places;            /* 3 a vertex; wrap around */
    unsigned char *around, *size_of;
    uint32_t* edge_at; /* an edge that begins at each vertex, perhaps */
    uint32_t numbered, done_faces, done_corners;
    uint32_t last[3]; /* the place that was coded last */
    flg_edge* edges;
    uint32_t edge_room, edge_count, free_edge, first_edge, last_edge;
    /* what records need */
    float *positions, *driver_rest;
    uint32_t* driver_places;
    flg_plane* planes;
    uint32_t *cells, *cell_of, last_cell;
    float *u, *v;
    int32_t* off; /* 2 a vertex: the weights' differences */
    double weight_step, tolerance;
#ifdef FLG_WITH_WRITER
    const flg_code_source* source;
    const flg_faces* source_faces;
    uint32_t *source_of, *number_of; /* between numbers and the source's vertices */
    uint32_t next_loose;
    uint32_t *cell_number, *cell_turn; /* of each of the source's driver faces: the cell it becomes, its first corner */
#endif
} flg_walk;

static FLG_COLD int walk_fails(flg_walk* w, flg_status status) {
    if (w->status == FLG_OK) w->status = status;
    return w->status != FLG_OK;
}

static FLG_COLD void* take(flg_walk* w, uint64_t count, size_t item) {
    void* memory = w->status == FLG_OK ? w->memory->take(w->memory->user, count, item) : NULL;
    if (!memory) walk_fails(w, FLG_NO_MEMORY);
    return memory;
}

static void join(flg_walk* w, uint32_t left, uint32_t right) {
    if (left != FLG_NONE) w->edges[left].right = right;
    if (right != FLG_NONE) w->edges[right].left = left;
}

/* Edges of one ring that turn out to be two sides of the same. */
static void zip(flg_walk* w, uint32_t left, uint32_t right) {
    join(w, left, right);
    while (left != FLG_NONE && right != FLG_NONE && left != right) {
        flg_edge *l = w->edges + left, *r = w->edges + right;
        if (l->from != r->to || l->to != r->from || l->from == FLG_NONE) return;
        l->from = r->from = FLG_NONE;
        if (l->left == right) return;
        left = l->left;
        right = r->right;
        join(w, left, right);
    }
}

static uint32_t add_edge(flg_walk* w, uint32_t from, uint32_t to, uint32_t before, uint32_t after) {
    uint32_t at = w->free_edge;
    flg_edge* e;
    if (at != FLG_NONE) {
        w->free_edge = w->edges[at].next;
    } else {
        if (w->edge_count == w->edge_room) {
            const uint32_t room = w->edge_room > 0 ? 2 * w->edge_room : 4096;
            flg_edge* more = (flg_edge*)take(w, room, sizeof(flg_edge));
            if (!more) return FLG_NONE;
            if (w->edge_count > 0) memcpy(more, w->edges, w->edge_count * sizeof(flg_edge));
            w->edges = more;
            w->edge_room = room;
        }
        at = w->edge_count++;
    }
    e = w->edges + at;
    e->from = from;
    e->to = to;
    e->before = before;
    e->after = after;
    e->left = e->right = e->next = FLG_NONE;
    if (w->last_edge != FLG_NONE)
        w->edges[w->last_edge].next = at;
    else
        w->first_edge = at;
    w->last_edge = at;
    w->edge_at[from] = at;
    return at;
}

FLG_INLINE uint32_t size_class(uint32_t a, uint32_t b, uint32_t c) {
    uint32_t all = (uint32_t)((a ^ (0u - (a >> 31))) | (b ^ (0u - (b >> 31))) | (c ^ (0u - (c >> 31)))), bits = 0;
    for (; all > 0 && bits < SIZES - 1; all >>= 1) ++bits;
    return bits;
}

/* The place of vertex v, from where it is expected. */
static void code_place(flg_walk* w, uint32_t v, const uint32_t expected[3], uint32_t context) {
    uint32_t *place = w->places + 3 * (size_t)v, off[3] = {0, 0, 0};
#ifdef FLG_WITH_WRITER
    if (is_writing(&w->coder)) {
        const int32_t* of = w->source->places + 3 * (size_t)w->source_of[v];
        for (int k = 0; k < 3; ++k) off[k] = (uint32_t)of[k] - expected[k];
    }
#endif
    for (uint32_t k = 0; k < 3; ++k) {
        off[k] = code_difference(&w->coder, context + k, off[k]);
        place[k] = expected[k] + off[k];
        if (place[k] + FARTHEST > 2u * FARTHEST) walk_fails(w, FLG_DAMAGED);
        w->last[k] = place[k];
    }
    w->size_of[v] = (unsigned char)size_class(off[0], off[1], off[2]);
}

static void set_position(flg_walk* w, uint32_t v) {
    for (size_t k = 0; k < 3; ++k)
        w->positions[3 * (size_t)v + k] =
            (float)(w->sizes->low[k] + w->sizes->step * (double)(int32_t)w->places[3 * (size_t)v + k]);
}

/* The cell and the weights of vertex v; a, b: vertices whose cells are known, or none. */
static void code_record(flg_walk* w, uint32_t v, uint32_t a, uint32_t b) {
    const float* point = w->positions + 3 * (size_t)v;
    const uint32_t cells = w->sizes->cells;
    uint32_t near_a = a == FLG_NONE ? w->last_cell : w->cell_of[a], near_b = b == FLG_NONE ? near_a : w->cell_of[b];
    uint32_t cell = near_a, way = 0, symbol = 0;
    int32_t off[2] = {0, 0};
    flg_spot spot = closest_spot(w->planes + cell, point);
    double u, v_weight;
#ifdef FLG_WITH_WRITER
    double true_u = 0, true_v = 0;
#endif
    if (near_b != near_a) {
        const flg_spot other = closest_spot(w->planes + near_b, point);
        if (other.squared < spot.squared) {
            spot = other;
            cell = near_b;
        }
    }
    for (int steps = 0; steps < 8 && spot.behind < 3; ++steps) { /* downhill, as vertices are bound */
        const uint32_t beyond = w->planes[cell].beside[spot.behind];
        flg_spot other;
        if (beyond == FLG_NONE) break;
        other = closest_spot(w->planes + beyond, point);
        if (!(other.squared < spot.squared)) break;
        spot = other;
        cell = beyond;
    }
    {
        const uint32_t ways[6] = {
            cell, w->planes[cell].beside[0], w->planes[cell].beside[1], w->planes[cell].beside[2], near_a, near_b};
        const uint32_t context = CELL + (spot.behind < 3);
#ifdef FLG_WITH_WRITER
        if (is_writing(&w->coder)) {
            const uint32_t s = w->source_of[v];
            uint32_t wanted = w->source->cell[s], turn = 0;
            const double weights[3] = {1 - (double)w->source->u[s] - (double)w->source->v[s], (double)w->source->u[s],
                                       (double)w->source->v[s]};
            flg_spot there;
            if (!(w->sizes->flags & FLG_CODE_OTHER_CELLS)) {
                turn = w->cell_turn[wanted];
                wanted = w->cell_number[wanted];
            }
            true_u = weights[(1 + turn) % 3];
            true_v = weights[(2 + turn) % 3];
            there = wanted == cell ? spot : closest_spot(w->planes + wanted, point);
            while (way < 6 && ways[way] != wanted) ++way;
            if (distance_on(w->planes + wanted, true_u - there.u, true_v - there.v) > w->tolerance) {
                off[0] = (int32_t)floor((true_u - there.u) / w->weight_step + 0.5);
                off[1] = (int32_t)floor((true_v - there.v) / w->weight_step + 0.5);
            }
            symbol = 2 * way + (off[0] != 0 || off[1] != 0);
            cell = wanted;
        }
#endif
        symbol = code_symbol(&w->coder, context, symbol);
        way = symbol / 2;
        if (way < 6)
            cell = ways[way];
        else
            cell = code_bits(&w->coder, cell, flg_bits_to_name(cells));
        if (cell >= cells) {
            walk_fails(w, FLG_DAMAGED);
            cell = 0;
        }
        if (way > 0) spot = closest_spot(w->planes + cell, point);
    }
    {
        const int32_t *of_a = a != FLG_NONE && w->cell_of[a] == cell ? w->off + 2 * (size_t)a : NULL,
                      *of_b = b != FLG_NONE && w->cell_of[b] == cell ? w->off + 2 * (size_t)b : NULL;
        for (uint32_t k = 0; k < 2 && symbol % 2 != 0; ++k) {
            const uint32_t expected = of_a && of_b ? (uint32_t)((of_a[k] + of_b[k]) / 2)
                                      : of_a       ? (uint32_t)of_a[k]
                                      : of_b       ? (uint32_t)of_b[k]
                                                   : 0;
            off[k] = (int32_t)(expected + code_difference(&w->coder, WEIGHT + k, (uint32_t)off[k] - expected));
        }
    }
    u = spot.u + (double)off[0] * w->weight_step;
    v_weight = spot.v + (double)off[1] * w->weight_step;
    if (!(u >= 0)) u = 0;
    if (!(v_weight >= 0)) v_weight = 0;
    if (u > 1) u = 1;
    if (v_weight > 1 - u) v_weight = 1 - u;
    w->u[v] = (float)u;
    w->v[v] = (float)v_weight;
    w->cell_of[v] = cell;
    w->off[2 * (size_t)v] = off[0];
    w->off[2 * (size_t)v + 1] = off[1];
    w->last_cell = cell;
#ifdef FLG_WITH_WRITER
    if (is_writing(&w->coder))
        w->source->moved[w->source_of[v]] = distance_on(w->planes + cell, true_u - u, true_v - v_weight);
#endif
}

/* A corner: how it is known, and its number; source: of the writer. */
static uint32_t code_corner(flg_walk* w, uint32_t context, uint32_t left, uint32_t right, uint32_t source,
                            uint32_t* symbol) {
    uint32_t number = 0;
#ifdef FLG_WITH_WRITER
    if (is_writing(&w->coder) && source != FLG_NONE) {
        number = !w->is_driver ? w->number_of[source] : w->around[source] != 0 ? source : FLG_NONE;
        if (number == FLG_NONE) {
            number = w->is_driver ? source : w->source->driver_of[source];
            *symbol = !w->is_driver && number != FLG_NONE ? MEETS_DRIVER : MEETS_NEW;
        } else {
            *symbol = number == left ? MEETS_LEFT : number == right ? MEETS_RIGHT : MEETS_OLD;
        }
    }
#else
    (void)source;
#endif
    *symbol = code_symbol(&w->coder, context, *symbol);
    switch (*symbol) {
    case MEETS_LEFT:
        number = left;
        break;
    case MEETS_RIGHT:
        number = right;
        break;
    case MEETS_OLD:
        number = code_bits(&w->coder, number, flg_bits_to_name(w->vertices));
        break;
    case MEETS_DRIVER:
        number = code_bits(&w->coder, number, flg_bits_to_name(w->sizes->driver_vertices));
        break;
    case MEETS_NEW:
        number = w->is_driver ? code_bits(&w->coder, number, flg_bits_to_name(w->vertices)) : w->numbered++;
        break;
    default:
        return 0;
    }
    if (number >= w->vertices ||
        ((*symbol == MEETS_NEW || *symbol == MEETS_DRIVER) ? w->around[number] != 0 : w->around[number] == 0)) {
        walk_fails(w, FLG_DAMAGED);
        return 0;
    }
    if (*symbol == MEETS_DRIVER && (w->is_driver || number >= w->sizes->driver_vertices || !w->driver_places)) {
        walk_fails(w, FLG_DAMAGED);
        return 0;
    }
    w->around[number] = 1; /* met; its faces are counted when this one is known */
#ifdef FLG_WITH_WRITER
    if (is_writing(&w->coder) && !w->is_driver) {
        w->number_of[source] = number;
        w->source_of[number] = source;
    }
#endif
    return number;
}

/* The place and the record of a vertex that was met for the first time. */
static void code_vertex(flg_walk* w, uint32_t v, uint32_t symbol, const uint32_t expected[3], uint32_t context,
                        uint32_t a, uint32_t b) {
    if (w->is_driver && !w->places) return; /* its positions are in the file */
    if (symbol == MEETS_DRIVER) {
        memcpy(w->places + 3 * (size_t)v, w->driver_places + 3 * (size_t)v, 3 * sizeof(uint32_t));
        memcpy(w->last, w->places + 3 * (size_t)v, sizeof w->last);
        w->size_of[v] = a != FLG_NONE ? w->size_of[a] : 0;
    } else {
        code_place(w, v, expected, context);
    }
    set_position(w, v);
    if (!w->is_driver) code_record(w, v, a, b);
}

static void count_face(flg_walk* w, const uint32_t* corners, uint32_t count) {
    for (uint32_t k = 0; k < count; ++k)
        if (w->around[corners[k]] < 255) ++w->around[corners[k]];
    w->done_corners += count;
    ++w->done_faces;
    if (w->offsets) w->offsets[w->done_faces] = w->done_corners;
}

/* How many corners the next face has; 0: none. */
static FLG_COLD uint32_t code_degree(flg_walk* w, uint32_t degree) {
    uint32_t read;
    if (w->face_size > 0) return w->face_size;
    read = code_number(&w->coder, DEGREE, degree > 0 ? degree - 2 : 0);
    if (read > w->corner_count) walk_fails(w, FLG_DAMAGED);
    return read > 0 ? read + 2 : 0;
}

static int has_room(flg_walk* w, uint32_t degree) {
    return degree <= w->corner_count - w->done_corners && w->done_faces < w->faces ? 1 : !walk_fails(w, FLG_DAMAGED);
}

#ifdef FLG_WITH_WRITER
static uint32_t source_face(flg_walk* w, uint32_t from, uint32_t to, uint32_t* degree, uint32_t* corner) {
    const flg_faces* faces = w->source_faces;
    const uint32_t face = w->source->face_at(w->source->user, w->is_driver, from, to, corner);
    *degree = face == FLG_NONE ? 0 : faces->offsets ? faces->offsets[face + 1] - faces->offsets[face] : 3;
    if (face == FLG_NONE) return face;
    if (w->is_driver) {
        w->cell_number[face] = w->done_faces;
        w->cell_turn[face] = *corner - 3 * face;
        return face;
    }
    w->source->face_order[w->done_faces] = face;
    for (uint32_t k = 0; k < *degree; ++k) {
        const uint32_t begin = faces->offsets ? faces->offsets[face] : 3 * face;
        w->source->corner_order[w->done_corners + k] = begin + (*corner - begin + k) % *degree;
    }
    return face;
}
static uint32_t source_corner(const flg_walk* w, uint32_t face, uint32_t degree, uint32_t corner, uint32_t k) {
    const uint32_t begin = w->source_faces->offsets ? w->source_faces->offsets[face] : 3 * face;
    return w->source_faces->corners[begin + (corner - begin + k) % degree];
}
#endif

/* A face that meets no known edge. */
static FLG_COLD void code_seed(flg_walk* w) {
    uint32_t degree = 0, *corners = w->corners + w->done_corners;
#ifdef FLG_WITH_WRITER
    uint32_t face = FLG_NONE, corner = 0;
    if (is_writing(&w->coder)) face = source_face(w, FLG_NONE, FLG_NONE, &degree, &corner);
#endif
    degree = code_degree(w, degree);
    if (!has_room(w, degree) || degree < 3) {
        walk_fails(w, FLG_DAMAGED);
        return;
    }
    for (uint32_t k = 0; k < degree && w->status == FLG_OK; ++k) {
        uint32_t symbol = MEETS_NEW, source = FLG_NONE;
#ifdef FLG_WITH_WRITER
        if (is_writing(&w->coder)) source = source_corner(w, face, degree, corner, k);
#endif
        corners[k] = code_corner(w, SEED, FLG_NONE, FLG_NONE, source, &symbol);
        if (w->status == FLG_OK && (symbol == MEETS_NEW || symbol == MEETS_DRIVER)) {
            uint32_t expected[3];
            memcpy(expected, w->last, sizeof expected);
            code_vertex(w, corners[k], symbol, expected, FAR_PLACE, k > 0 ? corners[k - 1] : FLG_NONE, FLG_NONE);
        } else if (symbol != MEETS_OLD) {
            walk_fails(w, FLG_DAMAGED);
        }
    }
    if (w->status != FLG_OK) return;
    {
        uint32_t first = FLG_NONE, before = FLG_NONE;
        for (uint32_t k = 0; k < degree; ++k) {
            const uint32_t e = add_edge(w, corners[k], corners[(k + 1) % degree], corners[(k + degree - 1) % degree],
                                        corners[(k + 2) % degree]);
            if (e == FLG_NONE) return;
            join(w, before, e);
            if (k == 0) first = e;
            before = e;
        }
        join(w, before, first);
    }
    count_face(w, corners, degree);
}

/* Where corner i of a face behind an edge is expected; i counts behind the edge. */
static void expect_place(const flg_walk* w, const flg_edge* gate, const uint32_t* corners, uint32_t degree, uint32_t i,
                         int other_is_known, uint32_t expected[3]) {
    const uint32_t *b = w->places + 3 * (size_t)corners[0], *a = w->places + 3 * (size_t)corners[1],
                   *before = w->places + 3 * (size_t)gate->before, *after = w->places + 3 * (size_t)gate->after;
    for (int k = 0; k < 3; ++k) {
        if (degree == 3)
            expected[k] = a[k] + b[k] - (uint32_t)((int32_t)(before[k] + after[k]) >> 1);
        else if (degree == 4 && i == 1)
            expected[k] = w->places[3 * (size_t)corners[2] + (size_t)k] + b[k] - a[k];
        else if (degree == 4 && other_is_known)
            expected[k] = w->places[3 * (size_t)corners[3] + (size_t)k] + a[k] - b[k];
        else if (i == 0)
            expected[k] = 2 * a[k] - before[k];
        else
            expected[k] = w->places[3 * (size_t)corners[1 + i] + (size_t)k];
    }
}

/* The face behind the first edge of the queue. */
static void code_face(flg_walk* w) {
    const uint32_t at = w->first_edge;
    const flg_edge gate = w->edges[at];
    uint32_t degree = 0, *corners = w->corners + w->done_corners, left = gate.left, right = gate.right, symbols[4];
    uint32_t first_new = 0, begin = 0, end;
    int chain = 1;
#ifdef FLG_WITH_WRITER
    uint32_t face = FLG_NONE, corner = 0;
#endif
    w->first_edge = gate.next;
    if (gate.next == FLG_NONE) w->last_edge = FLG_NONE;
    w->edges[at].next = w->free_edge;
    w->edges[at].from = FLG_NONE;
    w->free_edge = at;
    if (gate.from == FLG_NONE) return;
    if (left == at) left = FLG_NONE;
    if (right == at) right = FLG_NONE;
#ifdef FLG_WITH_WRITER
    if (is_writing(&w->coder))
        face = w->is_driver ? source_face(w, gate.to, gate.from, &degree, &corner)
                            : source_face(w, w->source_of[gate.to], w->source_of[gate.from], &degree, &corner);
#endif
    degree = code_degree(w, degree);
    end = degree;
    if (degree > 0) {
        if (!has_room(w, degree)) return;
        corners[0] = gate.to;
        corners[1] = gate.from;
    }
    for (uint32_t i = 0; i + 2 < degree && w->status == FLG_OK; ++i) {
        const uint32_t behind = degree - 2 - i;
        const uint32_t around_a = w->around[gate.from] - 1u, around_b = w->around[gate.to] - 1u;
        const uint32_t context = i > 0 ? LATER_CORNER + (i > 1)
                                       : FIRST_CORNER + AROUND * (around_a < AROUND ? around_a : AROUND - 1) +
                                             (around_b < AROUND ? around_b : AROUND - 1);
        uint32_t symbol = MEETS_NOTHING, source = FLG_NONE, meets_left = FLG_NONE, meets_right = FLG_NONE;
        if (chain && left != FLG_NONE) meets_left = w->edges[left].from;
        if (behind == 1 && right != FLG_NONE) meets_right = w->edges[right].to;
        if (behind == 2 && right != FLG_NONE && w->edges[right].right != FLG_NONE)
            meets_right = w->edges[w->edges[right].right].to;
#ifdef FLG_WITH_WRITER
        if (is_writing(&w->coder) && face != FLG_NONE) source = source_corner(w, face, degree, corner, i + 2);
#endif
        corners[2 + i] = code_corner(w, context, meets_left, meets_right, source, &symbol);
        if (symbol == MEETS_NOTHING && i == 0 && w->face_size > 0) {
            degree = 0;
            break;
        }
        if (symbol > MEETS_DRIVER) walk_fails(w, FLG_DAMAGED);
        if (i < 4) symbols[i] = symbol;
        chain = chain && symbol == MEETS_LEFT;
        if (chain && left != FLG_NONE) left = w->edges[left].left;
        if (left == at || (left != FLG_NONE && w->edges[left].from == FLG_NONE)) left = FLG_NONE;
        if (degree > 4 && (symbol == MEETS_NEW || symbol == MEETS_DRIVER) && w->status == FLG_OK) {
            uint32_t expected[3] = {0, 0, 0}; /* of large faces corner by corner, of others when all are known */
            if (w->places) expect_place(w, &gate, corners, degree, i, 0, expected);
            code_vertex(w, corners[2 + i], symbol, expected, FAR_PLACE, corners[1 + i], FLG_NONE);
        }
    }
    if (w->status != FLG_OK) return;
    if (degree == 0) { /* a border */
        if (gate.left != FLG_NONE && gate.left != at) w->edges[gate.left].right = FLG_NONE;
        if (gate.right != FLG_NONE && gate.right != at) w->edges[gate.right].left = FLG_NONE;
        return;
    }
    for (uint32_t i = 0; i + 2 < degree && degree <= 4 && w->status == FLG_OK; ++i) {
        const uint32_t symbol = symbols[i];
        if (symbol == MEETS_NEW || symbol == MEETS_DRIVER) {
            const uint32_t size = ((uint32_t)w->size_of[gate.from] + w->size_of[gate.to] + 1) / 2;
            uint32_t expected[3] = {0, 0, 0};
            if (w->places)
                expect_place(w, &gate, corners, degree, i,
                             i == 0 && degree == 4 && symbols[1] != MEETS_NEW && symbols[1] != MEETS_DRIVER, expected);
            code_vertex(w, corners[2 + i], symbol, expected, PLACE + 3 * size, i == 0 ? gate.from : corners[1 + i],
                        gate.to);
        }
    }
    if (w->status != FLG_OK) return;
    /* Edge k of the face leads from corner k to the next; edge 0 is the one that was known. */
    left = gate.left == at ? FLG_NONE : gate.left;
    right = gate.right == at ? FLG_NONE : gate.right;
    for (begin = 1; begin < end && left != FLG_NONE; ++begin) {
        flg_edge* e = w->edges + left;
        if (e->from == FLG_NONE || e->from != corners[(begin + 1) % degree] || e->to != corners[begin]) break;
        e->from = FLG_NONE;
        left = e->left == at ? FLG_NONE : e->left;
    }
    for (; end > begin && right != FLG_NONE; --end) {
        flg_edge* e = w->edges + right;
        if (e->from == FLG_NONE || e->to != corners[end - 1] || e->from != corners[end % degree]) break;
        e->from = FLG_NONE;
        right = e->right == at ? FLG_NONE : e->right;
    }
    if (left != FLG_NONE && w->edges[left].from == FLG_NONE) left = FLG_NONE;
    if (right != FLG_NONE && w->edges[right].from == FLG_NONE) right = FLG_NONE;
    first_new = left;
    for (uint32_t k = begin; k < end; ++k) {
        const uint32_t from = corners[k], other = k > begin ? w->edge_at[from] : FLG_NONE;
        const uint32_t e = add_edge(w, from, corners[(k + 1) % degree], corners[k - 1], corners[(k + 2) % degree]);
        if (e == FLG_NONE) return;
        if (other != FLG_NONE && w->edges[other].from == from && other != first_new && other != e) {
            const uint32_t before = w->edges[other].left; /* the ring is split, or becomes one with another */
            zip(w, first_new, other);
            first_new = before != FLG_NONE && w->edges[before].from != FLG_NONE ? before : FLG_NONE;
        }
        join(w, first_new, e);
        first_new = e;
    }
    if (first_new != FLG_NONE && w->edges[first_new].from == FLG_NONE) first_new = FLG_NONE;
    zip(w, first_new, right);
    count_face(w, corners, degree);
}

/* The surface at hand, and what no face of it meets. */
static void code_surface(flg_walk* w) {
    const flg_code_sizes* sizes = w->sizes;
    const uint32_t behind = sizes->flags & FLG_CODE_DRIVER_BEHIND ? sizes->driver_vertices : 0;
    w->around = (unsigned char*)take(w, w->vertices, 1);
    w->size_of = (unsigned char*)take(w, w->vertices, 1);
    w->edge_at = (uint32_t*)take(w, w->vertices, sizeof(uint32_t));
    if (w->status != FLG_OK) return;
    memset(w->around, 0, w->vertices);
    memset(w->size_of, 0, w->vertices);
    memset(w->edge_at, 0xff, (size_t)w->vertices * sizeof(uint32_t));
    memset(w->last, 0, sizeof w->last);
    w->free_edge = w->first_edge = w->last_edge = FLG_NONE;
    w->edge_count = w->done_faces = w->done_corners = 0;
    if (w->offsets) w->offsets[0] = 0;
    while (w->status == FLG_OK && w->done_faces < w->faces) {
        if (w->first_edge == FLG_NONE)
            code_seed(w);
        else
            code_face(w);
        if (!is_writing(&w->coder) && w->coder.in.is_damaged) walk_fails(w, FLG_DAMAGED);
    }
    if (w->status == FLG_OK && w->done_corners != w->corner_count) walk_fails(w, FLG_DAMAGED);
    for (uint32_t v = 0; v < w->vertices && w->status == FLG_OK; ++v) {
        uint32_t expected[3];
        const int is_own = !w->is_driver && behind > 0 && v >= w->vertices - behind;
        if (w->around[v] != 0) continue;
#ifdef FLG_WITH_WRITER
        if (is_writing(&w->coder) && !w->is_driver && (is_own || (behind == 0 && v < sizes->driver_vertices))) {
            w->source_of[v] = w->source->vertex_of[is_own ? v - (w->vertices - behind) : v];
        } else if (is_writing(&w->coder) && !w->is_driver) { /* the source's next one that has no number */
            while (w->number_of[w->next_loose] != FLG_NONE || w->source->driver_of[w->next_loose] != FLG_NONE)
                ++w->next_loose;
            w->source_of[v] = w->next_loose;
        }
        if (is_writing(&w->coder) && !w->is_driver) w->number_of[w->source_of[v]] = v;
#endif
        memcpy(expected, w->last, sizeof expected);
        if (is_own) {
            const uint32_t i = v - (w->vertices - behind);
            memcpy(w->positions + 3 * (size_t)v, w->driver_rest + 3 * (size_t)i, 3 * sizeof(float));
            memset(w->places + 3 * (size_t)v, 0, 3 * sizeof(uint32_t));
            code_record(w, v, FLG_NONE, FLG_NONE);
        } else {
            const int is_drivers = !w->is_driver && behind == 0 && v < sizes->driver_vertices;
            code_vertex(w, v, is_drivers ? MEETS_DRIVER : MEETS_NEW, expected, FAR_PLACE, FLG_NONE, FLG_NONE);
        }
        if (!is_writing(&w->coder) && w->coder.in.is_damaged) walk_fails(w, FLG_DAMAGED);
    }
}

static FLG_COLD int plane_edge(const uint32_t* cell, int k, uint64_t* key) {
    /* behind u < 0 lies edge 0-2, behind v < 0 edge 0-1, behind the third edge 1-2 */
    static const unsigned char ends[3][2] = {{0, 2}, {0, 1}, {1, 2}};
    const uint64_t a = cell[ends[k][0]], b = cell[ends[k][1]];
    *key = a < b ? a << 32 | b : b << 32 | a;
    return a != b;
}

static FLG_COLD void make_planes(flg_walk* w) {
    const uint32_t cells = w->sizes->cells;
    flg_key* keys = (flg_key*)take(w, 6 * (uint64_t)cells, sizeof(flg_key));
    size_t count = 0;
    w->planes = (flg_plane*)take(w, cells, sizeof(flg_plane));
    if (w->status != FLG_OK) return;
    for (uint32_t c = 0; c < cells; ++c) {
        flg_plane* plane = w->planes + c;
        const uint32_t* cell = w->cells + 3 * (size_t)c;
        for (int k = 0; k < 3; ++k) {
            plane->corner[k] = (double)w->driver_rest[3 * (size_t)cell[0] + (size_t)k];
            for (int j = 0; j < 2; ++j)
                plane->edge[j][k] = (double)w->driver_rest[3 * (size_t)cell[j + 1] + (size_t)k] - plane->corner[k];
            plane->beside[k] = FLG_NONE;
            if (plane_edge(cell, k, &keys[count].key)) keys[count++].value = 3 * c + (uint32_t)k;
        }
        measure_plane(plane);
    }
    flg_sort(keys, keys + 3 * (size_t)cells, count);
    for (size_t k = 0; k + 1 < count; ++k) {
        if (keys[k].key != keys[k + 1].key) continue;
        w->planes[keys[k].value / 3].beside[keys[k].value % 3] = keys[k + 1].value / 3;
        w->planes[keys[k + 1].value / 3].beside[keys[k + 1].value % 3] = keys[k].value / 3;
        ++k;
    }
}

/* Of the driver, then of the mesh. */
static FLG_COLD void code_model(flg_walk* w, uint32_t** driver_corners) {
    const flg_code_sizes* sizes = w->sizes;
    const int behind = (sizes->flags & FLG_CODE_DRIVER_BEHIND) != 0;
    uint32_t* driver;
    w->weight_step = 1.0 / (double)(1u << sizes->weight_bits);
    w->is_driver = 1;
    w->vertices = sizes->driver_vertices;
    w->faces = sizes->driver_faces;
    w->corner_count = 3 * sizes->driver_faces;
    w->face_size = 3;
    w->offsets = NULL;
    w->corners = driver = (uint32_t*)take(w, (uint64_t)w->corner_count + 3, sizeof(uint32_t));
    if (!behind) {
        w->places = (uint32_t*)take(w, w->vertices, 3 * sizeof(uint32_t));
        w->positions = w->driver_rest = (float*)take(w, w->vertices, 3 * sizeof(float));
    }
#ifdef FLG_WITH_WRITER
    if (is_writing(&w->coder)) {
        w->source_faces = &w->source->driver;
        w->cell_number = (uint32_t*)take(w, sizes->driver_faces, sizeof(uint32_t));
        w->cell_turn = (uint32_t*)take(w, sizes->driver_faces, sizeof(uint32_t));
        w->source_of = (uint32_t*)take(w, w->vertices, sizeof(uint32_t));
        if (w->status == FLG_OK) memcpy(w->source_of, w->source->vertex_of, (size_t)w->vertices * sizeof(uint32_t));
    }
#endif
    if (w->status != FLG_OK) return;
    code_surface(w);
    w->driver_places = w->places;
    *driver_corners = driver;
    /* Cells. */
    w->cells = driver;
    if (sizes->flags & FLG_CODE_OTHER_CELLS) {
        const uint32_t bits = flg_bits_to_name(sizes->driver_vertices);
        w->cells = (uint32_t*)take(w, sizes->cells, 3 * sizeof(uint32_t));
        for (size_t k = 0; w->status == FLG_OK && k < 3 * (size_t)sizes->cells; ++k) {
            uint32_t value = 0;
#ifdef FLG_WITH_WRITER
            if (is_writing(&w->coder)) value = w->source->cells[k];
#endif
            w->cells[k] = code_bits(&w->coder, value, bits);
            if (w->cells[k] >= sizes->driver_vertices) walk_fails(w, FLG_DAMAGED);
        }
    }
    if (w->status == FLG_OK) make_planes(w);
    /* The mesh. */
    w->is_driver = 0;
    w->vertices = (uint32_t)sizes->vertices;
    w->faces = (uint32_t)sizes->faces;
    w->corner_count = (uint32_t)sizes->corners;
    w->face_size = sizes->face_size;
    w->numbered = behind ? 0 : sizes->driver_vertices;
    w->corners = (uint32_t*)take(w, sizes->corners + 4, sizeof(uint32_t));
    w->offsets = sizes->face_size == 0 ? (uint32_t*)take(w, sizes->faces + 1, sizeof(uint32_t)) : NULL;
    w->places = (uint32_t*)take(w, w->vertices, 3 * sizeof(uint32_t));
    w->positions = (float*)take(w, w->vertices, 3 * sizeof(float));
    w->cell_of = (uint32_t*)take(w, w->vertices, sizeof(uint32_t));
    w->u = (float*)take(w, w->vertices, sizeof(float));
    w->v = (float*)take(w, w->vertices, sizeof(float));
    w->off = (int32_t*)take(w, w->vertices, 2 * sizeof(int32_t));
    w->last_cell = 0;
#ifdef FLG_WITH_WRITER
    if (is_writing(&w->coder) && w->status == FLG_OK) {
        w->source_faces = &w->source->mesh;
        w->number_of = w->source->number_of;
        w->source_of = (uint32_t*)take(w, w->vertices, sizeof(uint32_t));
        if (w->status == FLG_OK) memset(w->number_of, 0xff, (size_t)w->vertices * sizeof(uint32_t));
    }
#endif
    if (w->status == FLG_OK) code_surface(w);
}

/* ---- Values of vertices, corners and faces ---- */

enum { SAME = 0, FRESH = 1, OLDER = 2, MISSING = 3, WHICH = 48, COLUMN = 0, MOST_COLUMNS = 4 };

typedef struct flg_valued {
    const flg_code_values* of;
    int32_t* items;
    uint32_t base; /* of contexts */
} flg_valued;

static FLG_COLD int is_of_corners(uint32_t kind) {
    return kind == FLG_VALUES_OF_CORNERS || kind == FLG_NORMALS_OF_CORNERS;
}

/* The item `at`, expected between two others, which may be the same, or none. */
static FLG_COLD void code_item(flg_coder* c, const flg_valued* values, uint32_t at, uint32_t one, uint32_t other,
                               const int32_t* source) {
    const uint32_t columns = values->of->columns;
    for (uint32_t k = 0; k < columns; ++k) {
        const uint32_t x = one == FLG_NONE ? 0 : (uint32_t)values->items[(size_t)one * columns + k],
                       y = other == FLG_NONE ? x : (uint32_t)values->items[(size_t)other * columns + k],
                       expected = x + (uint32_t)((int32_t)(y - x) >> 1);
        const uint32_t wanted = source ? (uint32_t)source[k] : 0;
        values->items[(size_t)at * columns + k] =
            (int32_t)(expected + code_difference(c, values->base + COLUMN + k, wanted - expected));
    }
}

/* source: the items to write. */
static FLG_COLD void code_vertex_values(flg_walk* w, const flg_valued* values, const flg_faces* faces, uint32_t corners,
                                        const int32_t* source) {
    const uint32_t vertices = (uint32_t)w->sizes->vertices, columns = values->of->columns;
    const int mixes = values->of->kind != FLG_WORDS_OF_VERTICES;
    unsigned char* known = (unsigned char*)take(w, vertices, 1);
    uint32_t last = FLG_NONE;
    if (!known) return;
    memset(known, 0, vertices);
    for (size_t f = 0; f < faces->count; ++f) {
        const uint32_t begin = faces->offsets ? faces->offsets[f] : (uint32_t)(f * w->sizes->face_size),
                       end = faces->offsets ? faces->offsets[f + 1] : begin + w->sizes->face_size;
        for (uint32_t c = begin; c < end && c < corners; ++c) {
            const uint32_t v = faces->corners[c], one = c > begin ? faces->corners[c - 1] : last,
                           other = mixes && c > begin + 1 ? faces->corners[c - 2] : one;
            if (!known[v]) code_item(&w->coder, values, v, one, other, source ? source + (size_t)v * columns : NULL);
            known[v] = 1;
            last = v;
        }
    }
    for (uint32_t v = 0; v < vertices; ++v) {
        if (!known[v]) code_item(&w->coder, values, v, last, last, source ? source + (size_t)v * columns : NULL);
        last = v;
    }
}

/* item_of: of each corner, read or written; source_of: as the writer's items have it. */
static FLG_COLD void code_corner_values(flg_walk* w, const flg_valued* values, const flg_faces* faces,
                                        uint32_t* item_of, const int32_t* source, const uint32_t* source_of) {
    const uint32_t vertices = (uint32_t)w->sizes->vertices, count = values->of->count, columns = values->of->columns,
                   bits = flg_bits_to_name(count);
    uint32_t *last_at = (uint32_t*)take(w, vertices, sizeof(uint32_t)), *number = NULL, done = 0;
    if (source) number = (uint32_t*)take(w, count, sizeof(uint32_t));
    if (w->status != FLG_OK) return;
    memset(last_at, 0xff, (size_t)vertices * sizeof(uint32_t));
    if (number) memset(number, 0xff, (size_t)count * sizeof(uint32_t));
    for (size_t f = 0; f < faces->count && w->status == FLG_OK; ++f) {
        const uint32_t begin = faces->offsets ? faces->offsets[f] : (uint32_t)(f * w->sizes->face_size),
                       end = faces->offsets ? faces->offsets[f + 1] : begin + w->sizes->face_size;
        for (uint32_t c = begin; c < end; ++c) {
            const uint32_t v = faces->corners[c], wanted = source_of ? source_of[c] : FLG_NONE,
                           named = number && wanted != FLG_NONE ? number[wanted] : FLG_NONE;
            uint32_t way = source_of && wanted == FLG_NONE ? MISSING
                           : named == FLG_NONE             ? FRESH
                           : named == last_at[v]           ? SAME
                                                           : OLDER,
                     item = FLG_NONE;
            way = code_symbol(&w->coder, values->base + WHICH + (last_at[v] != FLG_NONE), way);
            if (way == SAME) {
                item = last_at[v];
            } else if (way == OLDER) {
                item = code_bits(&w->coder, named, bits);
                if (item >= done) walk_fails(w, FLG_DAMAGED);
            } else if (way == FRESH && done < count) {
                const uint32_t before = c > begin ? item_of[c - 1] : FLG_NONE,
                               one = before != FLG_NONE       ? before
                                     : last_at[v] != FLG_NONE ? last_at[v]
                                                              : done - 1,
                               two = c > begin + 1 && item_of[c - 2] != FLG_NONE ? item_of[c - 2] : one;
                item = done++;
                if (number) number[wanted] = item;
                code_item(&w->coder, values, item, item > 0 ? one : FLG_NONE, item > 0 ? two : FLG_NONE,
                          source ? source + (size_t)wanted * columns : NULL);
            } else if (way != MISSING) {
                walk_fails(w, FLG_DAMAGED);
            }
            if (w->status != FLG_OK) return;
            item_of[c] = item;
            if (item != FLG_NONE) last_at[v] = item;
        }
    }
    if (done != count) walk_fails(w, FLG_DAMAGED);
}

static FLG_COLD void code_face_values(flg_walk* w, const flg_valued* values, const int32_t* source) {
    int32_t last = 0;
    for (uint32_t f = 0; f < values->of->count; ++f) {
        const uint32_t changes = code_symbol(&w->coder, values->base, source ? source[f] != last : 0);
        if (changes) last = (int32_t)code_difference(&w->coder, values->base + 1, source ? (uint32_t)source[f] : 0);
        values->items[f] = last;
    }
}

static FLG_COLD void unfold_normal(int32_t x, int32_t y, float n[3]) {
    const double one = 1023;
    double p = (double)x / one, q = (double)y / one, z, length;
    n[0] = n[1] = n[2] = 0;
    if (x > 1023 || y > 1023 || x < -1023 || y < -1023) return; /* none */
    z = 1 - fabs(p) - fabs(q);
    if (z < 0) {
        const double folded = (1 - fabs(q)) * (p < 0 ? -1 : 1);
        q = (1 - fabs(p)) * (q < 0 ? -1 : 1);
        p = folded;
    }
    length = sqrt(p * p + (q * q + z * z));
    n[0] = (float)(p / length);
    n[1] = (float)(q / length);
    n[2] = (float)(z / length);
}

/* ---- Plain sections ---- */

typedef struct flg_reading {
    flg_walk walk;
    flg_plain_section* sections;
} flg_reading;

static FLG_COLD void add_section(flg_reading* r, const char* name, uint32_t index, uint32_t item, uint64_t count,
                                 void* items) {
    flg_plain_section* section;
    if (count == 0) return;
    section = (flg_plain_section*)take(&r->walk, 1, sizeof *section);
    if (!section) return;
    memset(section->name, 0, sizeof section->name);
    for (int k = 0; k < 8 && name[k]; ++k) section->name[k] = name[k];
    section->next = r->sections;
    section->index = index;
    section->item = item;
    section->count = count;
    section->items = items;
    r->sections = section;
}

static FLG_COLD void add_number(flg_reading* r, const char* name, uint32_t value) {
    uint32_t* item = (uint32_t*)take(&r->walk, 1, sizeof value);
    if (item) *item = value;
    add_section(r, name, 0, 4, 1, item);
}

/* The records of all chunks, one behind another. */
typedef struct flg_all_records {
    uint32_t* starts; /* of cells, in a block */
    uint16_t* from;
    float *u, *v;
} flg_all_records;

/* The records of a chunk, block by block and by cell. */
static FLG_COLD void add_chunk(flg_reading* r, uint32_t k, const flg_all_records* all) {
    enum { BLOCK = 1 << 15, CHUNK = 1 << 18 };
    flg_walk* w = &r->walk;
    const uint32_t first = k * CHUNK, left = w->vertices - first, count = left < CHUNK ? left : (uint32_t)CHUNK,
                   cells = w->sizes->cells;
    uint32_t *runs = (uint32_t*)take(w, count, 8), *starts = all->starts, run_count = 0;
    uint16_t* from = all->from + first;
    float *u = all->u + first, *v = all->v + first;
    if (w->status != FLG_OK) return;
    for (uint32_t begin = 0; begin < count; begin += BLOCK) {
        const uint32_t end = count - begin < BLOCK ? count : begin + (uint32_t)BLOCK;
        uint32_t at = 0;
        memset(starts, 0, (size_t)cells * sizeof *starts);
        for (uint32_t i = begin; i < end; ++i) ++starts[w->cell_of[first + i]];
        for (uint32_t c = 0; c < cells; ++c) {
            const uint32_t here = starts[c];
            if (here > 0) {
                runs[2 * (size_t)run_count] = c;
                runs[2 * (size_t)run_count++ + 1] = here;
            }
            starts[c] = at;
            at += here;
        }
        for (uint32_t i = begin; i < end; ++i) {
            const uint32_t to = starts[w->cell_of[first + i]]++;
            from[i] = (uint16_t)to;
            u[begin + to] = w->u[first + i];
            v[begin + to] = w->v[first + i];
        }
    }
    add_section(r, "bl.run", k, 8, run_count, runs);
    add_section(r, "bl.from", k, 2, count, from);
    add_section(r, "bl.u", k, 4, count, u);
    add_section(r, "bl.v", k, 4, count, v);
    add_section(r, "mesh.pos", k, 12, count, w->positions + 3 * (size_t)first);
}

static FLG_COLD void add_model(flg_reading* r, uint32_t* driver_corners) {
    flg_walk* w = &r->walk;
    const flg_code_sizes* sizes = w->sizes;
    const int behind = (sizes->flags & FLG_CODE_DRIVER_BEHIND) != 0;
    uint64_t* vertices = (uint64_t*)take(w, 1, sizeof(uint64_t));
    uint32_t* driver = (uint32_t*)take(w, sizes->driver_vertices, sizeof(uint32_t));
    flg_all_records records;
    records.starts = (uint32_t*)take(w, sizes->cells, sizeof(uint32_t));
    records.from = (uint16_t*)take(w, sizes->vertices, 2);
    records.u = (float*)take(w, sizes->vertices, 4);
    records.v = (float*)take(w, sizes->vertices, 4);
    if (w->status != FLG_OK) return;
    *vertices = sizes->vertices;
    for (uint32_t i = 0; i < sizes->driver_vertices; ++i)
        driver[i] = i + (behind ? (uint32_t)sizes->vertices - sizes->driver_vertices : 0);
    add_section(r, "mesh.num", 0, 8, 1, vertices);
    if (behind) add_number(r, "mesh.drv", 1);
    if (sizes->face_size > 0)
        add_number(r, "mesh.siz", sizes->face_size);
    else
        add_section(r, "mesh.off", 0, 4, sizes->faces > 0 ? sizes->faces + 1 : 0, w->offsets);
    add_section(r, "mesh.cor", 0, 4, sizes->corners, w->corners);
    add_number(r, "code", 1);
    add_number(r, "levels", 1);
    add_section(r, "lev.vert", 0, 4, sizes->driver_vertices, driver);
    if (sizes->driver_faces > 0) add_number(r, "lev.siz", 3);
    add_section(r, "lev.cor", 0, 4, 3 * (uint64_t)sizes->driver_faces, driver_corners);
    add_number(r, "bl.prec", 0);
    add_section(r, "bl.cell", 0, 12, sizes->cells, w->cells);
    for (uint32_t k = 0; w->status == FLG_OK && (uint64_t)k << 18 < sizes->vertices; ++k) add_chunk(r, k, &records);
}

static FLG_COLD flg_status check_sizes(const flg_code_sizes* s, double most_bytes) {
    int is_sound = 1;
    if (s->revision > FLG_CODE_REVISION) return FLG_NEWER;
    for (int k = 0; k < 3; ++k) is_sound &= fabs(s->low[k]) <= DBL_MAX;
    is_sound &= s->step > 0 && s->step * (double)FARTHEST <= FLT_MAX;
    is_sound &= s->vertices < FLG_NONE && s->corners < FLG_NONE - 8 && s->faces <= s->corners / 3;
    is_sound &= s->driver_vertices > 0 && s->driver_vertices <= s->vertices && s->driver_faces < FLG_NONE / 3 - 1;
    is_sound &= s->cells > 0 && s->cells < FLG_NONE / 6 && s->weight_bits <= 20;
    is_sound &= (s->flags & FLG_CODE_OTHER_CELLS) != 0 || s->cells == s->driver_faces;
    is_sound &= s->face_size == 0 || (s->face_size >= 3 && s->corners == s->faces * s->face_size);
    return s->revision == FLG_CODE_REVISION && is_sound && flg_code_bytes(s) <= most_bytes ? FLG_OK : FLG_DAMAGED;
}

static FLG_COLD void begin_walk(flg_walk* w, const flg_code_sizes* sizes, const flg_code_input* memory) {
    memset(w, 0, sizeof *w);
    w->sizes = sizes;
    w->memory = memory;
}

static FLG_COLD void begin_stream(flg_reading* r, const char* name, uint32_t contexts) {
    flg_walk* w = &r->walk;
    uint64_t size;
    const void* stream = w->memory->section(w->memory->user, name, 0, 1, &size);
    w->coder.shares = (flg_shares*)take(w, contexts, sizeof(flg_shares));
    if (!stream) walk_fails(w, FLG_DAMAGED);
    if (w->status != FLG_OK) return;
    for (uint32_t k = 0; k < contexts; ++k) flg_shares_begin(w->coder.shares + k);
    flg_symbols_begin(&w->coder.in, stream, (size_t)size);
}

static FLG_COLD const char* corners_name(const flg_code_values* of) {
    return of->name[0] == 'u' ? "uv.cor" : "nrm.cor";
}

/* The k-th of the section "rt.att", whose stream follows those of the ones before. */
static FLG_COLD void read_values(flg_reading* r, const flg_code_values* of, uint32_t k) {
    flg_walk* w = &r->walk;
    const flg_code_sizes* sizes = w->sizes;
    const int by_corner = is_of_corners(of->kind), is_normal = of->kind >= FLG_NORMALS_OF_VERTICES;
    const uint64_t most = by_corner                          ? sizes->corners
                          : of->kind == FLG_NUMBERS_OF_FACES ? sizes->faces
                                                             : sizes->vertices;
    const uint32_t width = is_normal ? 3 : of->columns;
    flg_faces faces;
    flg_valued values;
    uint32_t* item_of = NULL;
    faces.corners = w->corners;
    faces.offsets = w->offsets;
    faces.count = (size_t)sizes->faces;
    values.of = of;
    values.base = 0;
    if (of->kind > FLG_NORMALS_OF_CORNERS || of->columns == 0 || of->columns > MOST_COLUMNS ||
        (by_corner ? of->count > most : of->count != most) || (is_normal && of->columns != 2) ||
        (of->kind >= FLG_WORDS_OF_VERTICES && of->kind <= FLG_NUMBERS_OF_FACES && of->columns != 1)) {
        walk_fails(w, FLG_DAMAGED);
        return;
    }
    {
        uint64_t size;
        const void* stream = w->memory->section(w->memory->user, "rt.val", k, 1, &size);
        if (!stream) walk_fails(w, FLG_DAMAGED);
        values.items = (int32_t*)take(w, of->count, width * sizeof(int32_t));
        if (by_corner) item_of = (uint32_t*)take(w, sizes->corners, sizeof(uint32_t));
        if (w->status != FLG_OK) return;
        for (uint32_t c = 0; c < VALUE_CONTEXTS; ++c) flg_shares_begin(w->coder.shares + c);
        flg_symbols_begin(&w->coder.in, stream, (size_t)size);
    }
    if (by_corner)
        code_corner_values(w, &values, &faces, item_of, NULL, NULL);
    else if (of->kind == FLG_NUMBERS_OF_FACES)
        code_face_values(w, &values, NULL);
    else
        code_vertex_values(w, &values, &faces, (uint32_t)sizes->corners, NULL);
    if (w->coder.in.is_damaged) walk_fails(w, FLG_DAMAGED);
    if (w->status != FLG_OK) return;
    if (is_normal)
        for (size_t i = of->count; i-- > 0;) {
            float n[3];
            unfold_normal(values.items[2 * i], values.items[2 * i + 1], n);
            memcpy(values.items + 3 * i, n, sizeof n);
        }
    else if (of->kind < FLG_WORDS_OF_VERTICES)
        for (size_t i = 0; i < (size_t)of->count * width; ++i) {
            const float x = (float)(of->low[i % width] + of->step[i % width] * (double)values.items[i]);
            if (!(x <= FLT_MAX && x >= -FLT_MAX)) walk_fails(w, FLG_DAMAGED);
            memcpy(values.items + i, &x, sizeof x);
        }
    add_section(r, of->name, of->index, 4 * width, of->count, values.items);
    if (by_corner) add_section(r, corners_name(of), 0, 4, sizes->corners, item_of);
}

static FLG_COLD void read_attributes(flg_reading* r) {
    flg_walk* w = &r->walk;
    uint64_t count;
    const flg_code_values* all =
        (const flg_code_values*)w->memory->section(w->memory->user, "rt.att", 0, sizeof *all, &count);
    if (!all || w->status != FLG_OK) return;
    w->coder.shares = (flg_shares*)take(w, VALUE_CONTEXTS, sizeof(flg_shares));
    for (uint32_t k = 0; k < count && w->status == FLG_OK; ++k) {
        flg_code_values values;
        memcpy(&values, all + k, sizeof values);
        if (flg_code_bytes(w->sizes) + 24.0 * (double)count * (double)w->sizes->corners > w->memory->most_bytes)
            walk_fails(w, FLG_DAMAGED);
        if (w->status == FLG_OK) read_values(r, &values, k);
    }
}

static FLG_COLD void read_poses(flg_reading* r, const uint32_t* driver_corners) {
    flg_walk* w = &r->walk;
    const flg_code_sizes* sizes = w->sizes;
    const uint32_t vertices = sizes->driver_vertices, corners = 3 * sizes->driver_faces;
    uint64_t count;
    const uint32_t* head = (const uint32_t*)w->memory->section(w->memory->user, "rt.pose", 0, 8, &count);
    uint32_t frames, numbers, done = 0, *vertex, *beside, *starts;
    flg_key* keys;
    flg_faces faces;
    void* scratch;
    if (!head || w->status != FLG_OK) return;
    if (count != 1) {
        walk_fails(w, FLG_DAMAGED);
        return;
    }
    frames = head[0];
    numbers = head[1];
    if ((numbers != 3 && numbers != 12) ||
        8.0 * (double)frames * (double)vertices * (double)numbers > w->memory->most_bytes) {
        walk_fails(w, FLG_DAMAGED);
        return;
    }
    vertex = (uint32_t*)take(w, vertices, sizeof(uint32_t));
    beside = (uint32_t*)take(w, vertices, sizeof(uint32_t));
    starts = (uint32_t*)take(w, (uint64_t)vertices + 1, sizeof(uint32_t));
    keys = (flg_key*)take(w, 4 * (uint64_t)corners + 1, sizeof(flg_key));
    scratch = take(w, flg_clip_scratch_bytes((size_t)vertices * numbers), 1);
    if (w->status != FLG_OK) return;
    faces.corners = driver_corners;
    faces.offsets = NULL;
    faces.count = sizes->driver_faces;
    flg_clip_order(&faces, corners, vertices, vertex, beside, keys, starts);
    for (uint32_t k = 0; done < frames && w->status == FLG_OK; ++k) {
        uint64_t size;
        const void* stream = w->memory->section(w->memory->user, "rt.clip", k, 1, &size);
        const uint32_t in_block = stream ? flg_clip_frames(stream, (size_t)size) : 0;
        float* block;
        if (in_block < 2 || in_block - 1 > frames - done) {
            walk_fails(w, FLG_DAMAGED);
            return;
        }
        block = (float*)take(w, (uint64_t)in_block * vertices * numbers, sizeof(float));
        if (block && !flg_read_clip(stream, (size_t)size, numbers, vertex, beside, vertices, block, scratch))
            walk_fails(w, FLG_DAMAGED);
        for (uint32_t f = 1; f < in_block && w->status == FLG_OK; ++f, ++done) { /* the first is the driver at rest */
            const float* frame = block + (size_t)f * vertices * numbers;
            float *positions = (float*)take(w, vertices, 12), *gradients = NULL;
            if (numbers > 3) gradients = (float*)take(w, vertices, 36);
            for (size_t v = 0; v < vertices && w->status == FLG_OK; ++v) {
                memcpy(positions + 3 * v, frame + v * numbers, 12);
                for (size_t j = 0; j < 9 && gradients; ++j) /* plain files have row after row */
                    gradients[9 * v + j] = frame[v * numbers + 3 + j % 3 * 3 + j / 3];
            }
            add_section(r, "pose.pos", done, 12, vertices, positions);
            if (gradients) add_section(r, "pose.grd", done, 36, vertices, gradients);
        }
    }
}

flg_status flg_read_code(const flg_code_input* input, flg_plain_section** sections) {
    flg_reading r;
    flg_code_sizes sizes;
    uint64_t count = 0;
    uint32_t* driver_corners = NULL;
    const void* par = input->section(input->user, "rt.par", 0, sizeof sizes, &count);
    flg_status status;
    *sections = NULL;
    if (!par || count != 1) return FLG_DAMAGED;
    memcpy(&sizes, par, sizeof sizes);
    status = check_sizes(&sizes, input->most_bytes);
    if (status != FLG_OK) return status;
    r.sections = NULL;
    begin_walk(&r.walk, &sizes, input);
    if (sizes.flags & FLG_CODE_DRIVER_BEHIND) {
        const float* rest = (const float*)input->section(input->user, "rt.dpos", 0, 12, &count);
        if (!rest || count != sizes.driver_vertices) return FLG_DAMAGED;
        r.walk.driver_rest = (float*)take(&r.walk, count, 12);
        if (!r.walk.driver_rest) return FLG_NO_MEMORY;
        memcpy(r.walk.driver_rest, rest, 12 * (size_t)count);
        for (size_t k = 0; k < 3 * (size_t)count; ++k)
            if (!(rest[k] <= FLT_MAX && rest[k] >= -FLT_MAX)) return FLG_DAMAGED;
    }
    begin_stream(&r, "rt.mesh", MESH_CONTEXTS);
    if (r.walk.status == FLG_OK) code_model(&r.walk, &driver_corners);
    if (r.walk.status == FLG_OK) add_model(&r, driver_corners);
    read_attributes(&r);
    read_poses(&r, driver_corners);
    *sections = r.sections;
    return r.walk.status;
}

/* ---- Writing ---- */

#ifdef FLG_WITH_WRITER
void flg_closest_anchor(const float* corner0, const float* corner1, const float* corner2, const float* point,
                        float* anchor) {
    flg_plane plane;
    flg_spot spot;
    for (int k = 0; k < 3; ++k) {
        plane.corner[k] = (double)corner0[k];
        plane.edge[0][k] = (double)corner1[k] - plane.corner[k];
        plane.edge[1][k] = (double)corner2[k] - plane.corner[k];
    }
    measure_plane(&plane);
    spot = closest_spot(&plane, point);
    for (int k = 0; k < 3; ++k)
        anchor[k] = (float)(plane.corner[k] + (spot.u * plane.edge[0][k] + spot.v * plane.edge[1][k]));
}

flg_status flg_write_code(const flg_code_sizes* sizes, const flg_code_source* source, const flg_code_input* memory) {
    flg_walk w;
    uint32_t* driver_corners;
    const flg_status status = check_sizes(sizes, memory->most_bytes);
    if (status != FLG_OK) return status;
    begin_walk(&w, sizes, memory);
    w.coder.out = w.source = source;
    w.tolerance = source->anchor_tolerance;
    if (sizes->flags & FLG_CODE_DRIVER_BEHIND) {
        w.driver_rest = (float*)take(&w, sizes->driver_vertices, 12);
        if (!w.driver_rest) return FLG_NO_MEMORY;
        memcpy(w.driver_rest, source->driver_rest, 12 * (size_t)sizes->driver_vertices);
    }
    code_model(&w, &driver_corners);
    if (w.status != FLG_OK) return w.status;
    memcpy(source->read_corners, w.corners, (size_t)sizes->corners * sizeof(uint32_t));
    if (w.offsets) memcpy(source->read_offsets, w.offsets, ((size_t)sizes->faces + 1) * sizeof(uint32_t));
    return w.status;
}

flg_status flg_write_values(const flg_code_sizes* sizes, const flg_code_values* values, const flg_code_source* source,
                            const flg_faces* faces, const int32_t* items, const uint32_t* item_of,
                            const flg_code_input* memory) {
    flg_walk w;
    flg_valued of;
    begin_walk(&w, sizes, memory);
    w.coder.out = w.source = source;
    of.of = values;
    of.base = 0;
    of.items = (int32_t*)take(&w, values->count, values->columns * sizeof(int32_t));
    if (!of.items) return w.status;
    if (is_of_corners(values->kind)) {
        uint32_t* written = (uint32_t*)take(&w, sizes->corners, sizeof(uint32_t));
        if (written) code_corner_values(&w, &of, faces, written, items, item_of);
    } else if (values->kind == FLG_NUMBERS_OF_FACES) {
        code_face_values(&w, &of, items);
    } else {
        code_vertex_values(&w, &of, faces, (uint32_t)sizes->corners, items);
    }
    return w.status;
}
#endif

#else

flg_status flg_read_code(const flg_code_input* input, flg_plain_section** sections) {
    (void)input;
    *sections = NULL;
    return FLG_UNSUITABLE;
}

#endif
