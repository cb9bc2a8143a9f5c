/* The gradient at each driver vertex of the smoothest deformation that takes the vertices around it to where they are
 * now: of the triharmonic interpolant (kernel r^3, affine part free, quadratic part nearly so; Duchon 1977) of its
 * neighbours in space. The interpolant is linear in the positions, so each gradient is a sum of (c_j' - c_i') g_ij^T
 * with weights g_ij that are solved for once. docs/blend-code.md has the cases where neighbours are flat. */
#include "rt_fit.h"

#include <math.h>
#include <string.h>

#if FLG_HAS_FIT

enum {
    FLG_NEAR = 24, /* neighbours among all vertices */
    FLG_FAR = 8,   /* and among some */
    FLG_TERMS = FLG_NEAR + FLG_FAR,
    FLG_THINNING = 8,                       /* one in so many vertices is among some */
    FLG_TRIED = 3,                          /* candidates for each neighbour wanted */
    FLG_CANDIDATES = FLG_TRIED * FLG_NEAR,  /* the most that are looked for */
    FLG_ROOM = 2 * FLG_CANDIDATES + 8,      /* for those found so far */
    FLG_SMALLEST_PART = 32,                 /* places; smaller parts see all others */
    FLG_LEAF = 8,                           /* points of a tree's leaf */
    FLG_ROWS = FLG_TERMS + 1 + 4,           /* equations, the most there are */
    FLG_STRIDE = (FLG_ROWS + 3 + 3) / 4 * 4 /* of the matrix, with three right sides */
};
static const float FLG_ACROSS = 0.2f; /* cosine from which a vertex is in front of the surface */
static const double FLG_QUADRATICS =
    10; /* how cheap quadratic terms are beside the kernel; from 1 to 100 little changes */
static const double FLG_RIDGE = 3e-8; /* on the kernel: keeps vertices almost at one place solvable */
static const double FLG_FLAT = 6e-4,
                    FLG_SOLID = 6e-3;     /* thickness in widths: below the first completed, above the sum */
static const double FLG_NO_SPREAD = 1e-4; /* thickness in widths below which a direction has no linear term */

/* The terms of a vertex's sum. */
typedef struct flg_terms {
    double weights[FLG_TERMS][4]; /* the fourth is 0 */
    uint32_t vertices[FLG_TERMS];
    uint32_t count;
} flg_terms;

/* Directions in which a vertex's neighbours do not spread, and the share of what is completed there, 0 to 1. */
typedef struct flg_flatness {
    float line[3], normal[3]; /* along which they spread most, and least */
    float beside_line, off_plane;
} flg_flatness;

/* Points in the order of their places, in leaves of FLG_LEAF. Boxes: 6 floats a node, the lowest corner first; behind a
 * node those of its left half, then those of its right half. */
typedef struct flg_tree {
    uint32_t* vertices;
    float* points;
    float* boxes;
    uint32_t count;
} flg_tree;

/* A connected part's vertices, all of them and some. */
typedef struct flg_part {
    flg_tree all, some;
} flg_part;

struct flg_fit {
    flg_allocator allocator;
    uint32_t count;
    float* rest;
    const flg_kernel* kernel;
    flg_terms* terms;
    flg_flatness* flatness;
    float* rest_error; /* what the sum misses at rest: rounding, and everything where there are no neighbours */
    /* until flg_fit_end */
    uint32_t* place;     /* of each vertex the lowest vertex there */
    size_t* link_starts; /* of each vertex, and the end */
    uint32_t* links;     /* the edges at each place, both ways */
    uint32_t* part_of;
    flg_part* parts; /* the first holds everything */
    uint32_t part_count;
    uint32_t* tree_vertices; /* of all parts */
    float *tree_points, *tree_boxes;
    float* normals;
};

static double dot(const double a[3], const double b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

/* ---- What is connected ---- */

static uint32_t float_bits(float x) {
    uint32_t bits;
    x += 0.0f; /* -0 + 0 = 0 */
    memcpy(&bits, &x, sizeof bits);
    return bits;
}

static int is_same_place(const float* a, const float* b) { return a[0] == b[0] && a[1] == b[1] && a[2] == b[2]; }

/* For each vertex the lowest one at exactly its position. table: `slots` entries, a power of two above count. */
static FLG_COLD void find_places(const float* rest, uint32_t count, uint32_t* table, size_t slots, uint32_t* place) {
    for (size_t k = 0; k < slots; ++k) table[k] = FLG_NONE;
    for (uint32_t v = 0; v < count; ++v) {
        const float* p = rest + 3 * (size_t)v;
        uint64_t hash =
            ((uint64_t)float_bits(p[0]) << 32 | float_bits(p[1])) ^ (uint64_t)float_bits(p[2]) * 0x9e3779b97f4a7c15ull;
        size_t slot;
        hash = (hash ^ hash >> 29) * 0xbf58476d1ce4e5b9ull;
        hash ^= hash >> 32;
        for (slot = (size_t)hash & (slots - 1); table[slot] != FLG_NONE; slot = (slot + 1) & (slots - 1))
            if (is_same_place(rest + 3 * (size_t)table[slot], p)) break;
        if (table[slot] == FLG_NONE) table[slot] = v;
        place[v] = table[slot];
    }
}

/* The corners of face f that come after one another; begin and end of it. */
static FLG_COLD void face_range(const flg_faces* faces, size_t f, size_t* begin, size_t* end) {
    *begin = faces->offsets ? faces->offsets[f] : 3 * f;
    *end = faces->offsets ? faces->offsets[f + 1] : 3 * f + 3;
}

/* Counts the edges at each place (links NULL: into starts[place + 1]), or writes them (from next[place] on). */
static FLG_COLD void each_edge(const flg_fit* fit, const flg_faces* faces, size_t* at, uint32_t* links) {
    for (size_t f = 0; f < faces->count; ++f) {
        size_t begin, end;
        face_range(faces, f, &begin, &end);
        for (size_t c = begin; c < end; ++c) {
            const uint32_t a = fit->place[faces->corners[c]],
                           b = fit->place[faces->corners[c + 1 < end ? c + 1 : begin]];
            if (a == b) continue;
            if (links) {
                links[at[a]++] = b;
                links[at[b]++] = a;
            } else {
                ++at[(size_t)a + 1];
                ++at[(size_t)b + 1];
            }
        }
    }
}

static FLG_COLD int link_places(flg_fit* fit, const flg_faces* faces) {
    const uint32_t count = fit->count;
    size_t* next = NULL;
    fit->link_starts = (size_t*)flg_allocate(&fit->allocator, (uint64_t)count + 1, sizeof(size_t));
    next = (size_t*)flg_allocate(&fit->allocator, (uint64_t)count + 1, sizeof(size_t));
    if (fit->link_starts && next) {
        memset(fit->link_starts, 0, ((size_t)count + 1) * sizeof(size_t));
        each_edge(fit, faces, fit->link_starts, NULL);
        for (uint32_t v = 0; v < count; ++v) fit->link_starts[(size_t)v + 1] += fit->link_starts[v];
        memcpy(next, fit->link_starts, ((size_t)count + 1) * sizeof(size_t));
        fit->links = (uint32_t*)flg_allocate(&fit->allocator, fit->link_starts[count], sizeof(uint32_t));
        if (fit->links) each_edge(fit, faces, next, fit->links);
    }
    flg_release(&fit->allocator, next);
    return fit->links != NULL;
}

static FLG_COLD uint32_t root_of(uint32_t* above, uint32_t v) {
    while (above[v] != v) {
        above[v] = above[above[v]];
        v = above[v];
    }
    return v;
}

/* ---- Trees ---- */

/* The lower 21 bits of x, two zeros between each. */
static uint64_t spread_bits(uint64_t x) {
    x &= 0x1fffff;
    x = (x | x << 32) & 0x001f00000000ffffull;
    x = (x | x << 16) & 0x001f0000ff0000ffull;
    x = (x | x << 8) & 0x100f00f00f00f00full;
    x = (x | x << 4) & 0x10c30c30c30c30c3ull;
    return (x | x << 2) & 0x1249249249249249ull;
}

/* Sorts vertices, the keys' values, along a Morton curve [Morton 1966] through their box. */
static FLG_COLD void sort_by_place(const float* rest, flg_key* keys, flg_key* other, size_t count) {
    double low[3] = {DBL_MAX, DBL_MAX, DBL_MAX}, high[3] = {-DBL_MAX, -DBL_MAX, -DBL_MAX}, side = DBL_MIN;
    for (size_t i = 0; i < count; ++i)
        for (size_t k = 0; k < 3; ++k) {
            const double x = (double)rest[3 * (size_t)keys[i].value + k];
            if (x < low[k]) low[k] = x;
            if (x > high[k]) high[k] = x;
        }
    for (int k = 0; k < 3; ++k)
        if (high[k] - low[k] > side) side = high[k] - low[k];
    for (size_t i = 0; i < count; ++i) {
        keys[i].key = 0;
        for (size_t k = 0; k < 3; ++k) {
            const double steps = ((double)rest[3 * (size_t)keys[i].value + k] - low[k]) / side * 2097151.0;
            keys[i].key |= spread_bits((uint64_t)steps) << k;
        }
    }
    flg_sort(keys, other, count);
}

static uint32_t leaf_count(uint32_t points) { return points / FLG_LEAF + (points % FLG_LEAF != 0); }
static size_t node_count(uint32_t points) { return points > 0 ? 2 * (size_t)leaf_count(points) - 1 : 0; }

/* The boxes of node `node` and below, of leaves begin to end - 1. */
static FLG_COLD void make_boxes(flg_tree* tree, size_t node, uint32_t begin, uint32_t end) {
    float* box = tree->boxes + 6 * node;
    if (end - begin == 1) {
        const uint32_t first = begin * FLG_LEAF, last = tree->count - first < FLG_LEAF ? tree->count : first + FLG_LEAF;
        for (int k = 0; k < 3; ++k) box[k] = box[3 + k] = tree->points[3 * (size_t)first + (size_t)k];
        for (uint32_t i = first + 1; i < last; ++i)
            for (int k = 0; k < 3; ++k) {
                const float x = tree->points[3 * (size_t)i + (size_t)k];
                if (x < box[k]) box[k] = x;
                if (x > box[3 + k]) box[3 + k] = x;
            }
    } else {
        const uint32_t middle = begin + (end - begin) / 2;
        const size_t left = node + 1, right = node + 2 * (size_t)(middle - begin);
        const float *a = tree->boxes + 6 * left, *b = tree->boxes + 6 * right;
        make_boxes(tree, left, begin, middle);
        make_boxes(tree, right, middle, end);
        for (int k = 0; k < 3; ++k) {
            box[k] = a[k] < b[k] ? a[k] : b[k];
            box[3 + k] = a[3 + k] > b[3 + k] ? a[3 + k] : b[3 + k];
        }
    }
}

/* A tree of `count` vertices, which are at tree->vertices, in memory that is there. */
static FLG_COLD void make_tree(flg_tree* tree, const float* rest) {
    for (uint32_t i = 0; i < tree->count; ++i)
        memcpy(tree->points + 3 * (size_t)i, rest + 3 * (size_t)tree->vertices[i], 3 * sizeof(float));
    if (tree->count > 0) make_boxes(tree, 0, 0, leaf_count(tree->count));
}

static double squared_distance(const float* a, const float* b) {
    const double x = (double)a[0] - (double)b[0], y = (double)a[1] - (double)b[1], z = (double)a[2] - (double)b[2];
    return x * x + y * y + z * z;
}
/* Of the nearest place of a box: never more than squared_distance of a point in it, also after rounding. */
static double squared_distance_to_box(const float* p, const float* box) {
    double d[3];
    for (int k = 0; k < 3; ++k)
        d[k] = p[k] < box[k]       ? (double)box[k] - (double)p[k]
               : p[k] > box[3 + k] ? (double)p[k] - (double)box[3 + k]
                                   : 0;
    return d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
}

/* Those found so far. The key is the squared distance's bits, which ascend with it. */
typedef struct flg_candidates {
    size_t count, most;
    double farthest; /* squared; what is farther is not among the nearest `most` */
    flg_key found[FLG_ROOM];
} flg_candidates;

/* Leaves the nearest `most` of them, in no order: what is below a pivot goes to the left, until the pivot's place is
 * the right one. */
static void keep_nearest(flg_candidates* candidates) {
    flg_key* keys = candidates->found;
    const size_t wanted = candidates->most - 1;
    size_t begin = 0, end = candidates->count;
    if (end <= wanted) return;
    while (end - begin > 1) {
        const size_t middle = begin + (end - begin) / 2;
        const flg_key pivot = keys[middle];
        size_t place = begin;
        keys[middle] = keys[end - 1];
        for (size_t k = begin; k < end - 1; ++k) { /* without a branch that nobody can foresee */
            const flg_key key = keys[k];
            keys[k] = keys[place];
            keys[place] = key;
            place += (size_t)flg_comes_first(&key, &pivot);
        }
        keys[end - 1] = keys[place];
        keys[place] = pivot;
        if (place == wanted) break;
        if (place < wanted)
            begin = place + 1;
        else
            end = place;
    }
    candidates->count = candidates->most;
    memcpy(&candidates->farthest, &keys[wanted].key, sizeof(double));
}

/* Moves heap[at] down to where none below it comes first. */
static void sink(flg_key* heap, size_t count, size_t at) {
    const flg_key moved = heap[at];
    for (;;) {
        size_t child = 2 * at + 1;
        if (child >= count) break;
        if (child + 1 < count) child += (size_t)flg_comes_first(heap + child + 1, heap + child);
        if (!flg_comes_first(heap + child, &moved)) break;
        heap[at] = heap[child];
        at = child;
    }
    heap[at] = moved;
}
static void make_heap(flg_candidates* candidates) {
    for (size_t k = candidates->count / 2; k-- > 0;) sink(candidates->found, candidates->count, k);
}
/* Takes the nearest one out of a heap that is not empty. */
static uint32_t take_nearest(flg_candidates* candidates) {
    const uint32_t nearest = candidates->found[0].value;
    candidates->found[0] = candidates->found[--candidates->count];
    if (candidates->count > 1) sink(candidates->found, candidates->count, 0);
    return nearest;
}

/* Finds the `most` vertices nearest to a point, of equally far ones the lowest; in no order. */
static void find_nearest(const flg_tree* tree, const float* point, size_t most, flg_candidates* candidates) {
    struct {
        size_t node;
        double distance;
        uint32_t begin, end;
    } waiting[40]; /* a tree of 2^32 points is 30 deep */
    size_t depth = 0;
    candidates->count = 0;
    candidates->most = most;
    candidates->farthest = DBL_MAX;
    if (tree->count == 0) return;
    waiting[depth].node = 0;
    waiting[depth].distance = 0;
    waiting[depth].begin = 0;
    waiting[depth++].end = leaf_count(tree->count);
    while (depth > 0) {
        const size_t node = waiting[--depth].node;
        const uint32_t begin = waiting[depth].begin, end = waiting[depth].end;
        if (waiting[depth].distance > candidates->farthest) continue;
        if (end - begin == 1) {
            const uint32_t first = begin * FLG_LEAF,
                           last = tree->count - first < FLG_LEAF ? tree->count : first + FLG_LEAF;
            if (candidates->count > FLG_ROOM - FLG_LEAF) keep_nearest(candidates);
            for (uint32_t i = first; i < last; ++i) {
                const double distance = squared_distance(point, tree->points + 3 * (size_t)i);
                flg_key* next = candidates->found + candidates->count;
                memcpy(&next->key, &distance, sizeof distance);
                next->value = tree->vertices[i];
                candidates->count += distance <= candidates->farthest;
            }
        } else {
            const uint32_t middle = begin + (end - begin) / 2;
            const size_t left = node + 1, right = node + 2 * (size_t)(middle - begin);
            const double to_left = squared_distance_to_box(point, tree->boxes + 6 * left),
                         to_right = squared_distance_to_box(point, tree->boxes + 6 * right);
            const int right_first = to_right < to_left;
            for (int second = 0; second < 2; ++second, ++depth) { /* the nearer one is taken next */
                const int is_right = second == right_first;
                waiting[depth].node = is_right ? right : left;
                waiting[depth].distance = is_right ? to_right : to_left;
                waiting[depth].begin = is_right ? middle : begin;
                waiting[depth].end = is_right ? end : middle;
            }
        }
    }
    keep_nearest(candidates);
}

/* ---- Beginning ---- */

/* Gives every part of FLG_SMALLEST_PART places or more a number of its own, from 1 on; 0 is everything. sizes, above:
 * count numbers of scratch. */
static FLG_COLD void number_parts(flg_fit* fit, uint32_t* above, uint32_t* sizes) {
    uint32_t everything = 0;
    for (uint32_t v = 0; v < fit->count; ++v) {
        above[v] = v;
        sizes[v] = 0;
    }
    for (uint32_t v = 0; v < fit->count; ++v)
        for (size_t k = fit->link_starts[v]; k < fit->link_starts[(size_t)v + 1]; ++k) {
            const uint32_t a = root_of(above, v), b = root_of(above, fit->links[k]);
            if (a < b) above[b] = a;
            if (b < a) above[a] = b;
        }
    for (uint32_t v = 0; v < fit->count; ++v)
        if (fit->place[v] == v) {
            ++sizes[root_of(above, v)];
            ++everything;
        }
    fit->part_count = 1;
    for (uint32_t v = 0; v < fit->count; ++v) { /* a root comes before its members */
        const uint32_t root = root_of(above, v);
        if (fit->place[v] != v || sizes[root] < FLG_SMALLEST_PART || sizes[root] == everything)
            fit->part_of[v] = 0;
        else
            fit->part_of[v] = root == v ? fit->part_count++ : fit->part_of[root];
    }
}

/* The trees of all parts, one part behind the other. */
static FLG_COLD int make_parts(flg_fit* fit) {
    const uint32_t count = fit->count;
    size_t *starts = NULL, vertices = 0, points = 0, nodes = 0;
    flg_key *keys = NULL, *other = NULL;
    uint32_t places = 0;
    fit->parts = (flg_part*)flg_allocate(&fit->allocator, fit->part_count, sizeof(flg_part));
    starts = (size_t*)flg_allocate(&fit->allocator, (uint64_t)fit->part_count + 1, sizeof(size_t));
    keys = (flg_key*)flg_allocate(&fit->allocator, 2 * (uint64_t)count, sizeof(flg_key));
    other = (flg_key*)flg_allocate(&fit->allocator, count, sizeof(flg_key));
    if (!fit->parts || !starts || !keys || !other) goto end;
    /* Part 0 has every place; the others have their own behind it. */
    memset(starts, 0, ((size_t)fit->part_count + 1) * sizeof(size_t));
    for (uint32_t v = 0; v < count; ++v)
        if (fit->place[v] == v) {
            keys[places++].value = v;
            if (fit->part_of[v] > 0) ++starts[fit->part_of[v]];
        }
    {
        size_t sum = places;
        for (uint32_t part = 1; part <= fit->part_count; ++part) {
            const size_t size = part < fit->part_count ? starts[part] : 0;
            starts[part] = sum;
            sum += size;
        }
    }
    for (uint32_t v = 0; v < count; ++v)
        if (fit->place[v] == v && fit->part_of[v] > 0) keys[starts[fit->part_of[v]]++].value = v;
    for (uint32_t part = fit->part_count; part > 1; --part) starts[part] = starts[part - 1];
    if (fit->part_count > 1) starts[1] = places; /* each moved up to the end of its own */
    for (uint32_t part = 0; part < fit->part_count; ++part) {
        const size_t begin = part == 0 ? 0 : starts[part], end = part == 0 ? places : starts[part + 1];
        flg_part* made = fit->parts + part;
        made->all.count = (uint32_t)(end - begin);
        made->some.count = (made->all.count + FLG_THINNING / 2 - 1) / FLG_THINNING;
        sort_by_place(fit->rest, keys + begin, other, end - begin);
        vertices += (size_t)made->all.count + made->some.count;
        nodes += node_count(made->all.count) + node_count(made->some.count);
    }
    fit->tree_vertices = (uint32_t*)flg_allocate(&fit->allocator, vertices, sizeof(uint32_t));
    fit->tree_points = (float*)flg_allocate(&fit->allocator, vertices, 3 * sizeof(float));
    fit->tree_boxes = (float*)flg_allocate(&fit->allocator, nodes, 6 * sizeof(float));
    if (!fit->tree_vertices || !fit->tree_points || !fit->tree_boxes) goto end;
    nodes = 0;
    for (uint32_t part = 0; part < fit->part_count; ++part) {
        const flg_key* sorted = keys + (part == 0 ? 0 : starts[part]);
        flg_tree* trees[2];
        trees[0] = &fit->parts[part].all;
        trees[1] = &fit->parts[part].some;
        for (int some = 0; some < 2; ++some) {
            flg_tree* tree = trees[some];
            tree->vertices = fit->tree_vertices + points;
            tree->points = fit->tree_points + 3 * points;
            tree->boxes = fit->tree_boxes + 6 * nodes;
            for (uint32_t i = 0; i < tree->count; ++i)
                tree->vertices[i] = sorted[some ? (size_t)i * FLG_THINNING + FLG_THINNING / 2 : i].value;
            make_tree(tree, fit->rest);
            points += tree->count;
            nodes += node_count(tree->count);
        }
    }
end:
    flg_release(&fit->allocator, starts);
    flg_release(&fit->allocator, keys);
    flg_release(&fit->allocator, other);
    return fit->tree_boxes != NULL;
}

static FLG_COLD int prepare(flg_fit* fit, const flg_faces* faces) {
    const flg_allocator* from = &fit->allocator;
    size_t slots = 2;
    uint32_t *table = NULL, *above = NULL, *sizes = NULL;
    double* sums = NULL;
    int done = 0;
    while (slots <= (size_t)fit->count * 2) {
        slots *= 2;
        if (slots > SIZE_MAX / 16) return 0;
    }
    table = (uint32_t*)flg_allocate(from, slots, sizeof(uint32_t));
    above = (uint32_t*)flg_allocate(from, fit->count, sizeof(uint32_t));
    sizes = (uint32_t*)flg_allocate(from, fit->count, sizeof(uint32_t));
    sums = (double*)flg_allocate(from, fit->count, 3 * sizeof(double));
    if (table && above && sizes && sums) {
        flg_vertex_normals(fit->rest, fit->count, faces, sums, fit->normals);
        find_places(fit->rest, fit->count, table, slots, fit->place);
        if (link_places(fit, faces)) {
            number_parts(fit, above, sizes);
            done = make_parts(fit);
        }
    }
    flg_release(from, table);
    flg_release(from, above);
    flg_release(from, sizes);
    flg_release(from, sums);
    return done;
}

flg_fit* flg_fit_begin(const float* rest, uint32_t count, const flg_faces* faces, const flg_kernel* kernel,
                       const flg_allocator* allocator) {
    flg_fit* fit = (flg_fit*)flg_allocate(allocator, 1, sizeof(flg_fit));
    if (!fit) return NULL;
    memset(fit, 0, sizeof *fit);
    fit->allocator = *allocator;
    fit->count = count;
    fit->kernel = kernel;
    fit->rest = (float*)flg_allocate(allocator, count, 3 * sizeof(float));
    fit->terms = (flg_terms*)flg_allocate(allocator, count, sizeof(flg_terms));
    fit->flatness = (flg_flatness*)flg_allocate(allocator, count, sizeof(flg_flatness));
    fit->rest_error = (float*)flg_allocate(allocator, count, 9 * sizeof(float));
    fit->place = (uint32_t*)flg_allocate(allocator, count, sizeof(uint32_t));
    fit->part_of = (uint32_t*)flg_allocate(allocator, count, sizeof(uint32_t));
    fit->normals = (float*)flg_allocate(allocator, count, 3 * sizeof(float));
    if (fit->rest && fit->terms && fit->flatness && fit->rest_error && fit->place && fit->part_of && fit->normals) {
        memcpy(fit->rest, rest, 3 * (size_t)count * sizeof(float));
        if (prepare(fit, faces)) return fit;
    }
    flg_fit_free(fit);
    return NULL;
}

static FLG_COLD void free_search(flg_fit* fit) {
    void* const parts[] = {fit->place,         fit->link_starts, fit->links,      fit->part_of, fit->parts,
                           fit->tree_vertices, fit->tree_points, fit->tree_boxes, fit->normals};
    for (size_t k = 0; k < sizeof parts / sizeof parts[0]; ++k) flg_release(&fit->allocator, parts[k]);
    fit->place = fit->links = fit->part_of = fit->tree_vertices = NULL;
    fit->link_starts = NULL;
    fit->parts = NULL;
    fit->tree_points = fit->tree_boxes = fit->normals = NULL;
}

void flg_fit_free(flg_fit* fit) {
    flg_allocator allocator;
    if (!fit) return;
    allocator = fit->allocator;
    free_search(fit);
    flg_release(&allocator, fit->rest);
    flg_release(&allocator, fit->terms);
    flg_release(&allocator, fit->flatness);
    flg_release(&allocator, fit->rest_error);
    flg_release(&allocator, fit);
}

/* ---- Neighbours ---- */

/* What a thread needs for itself; behind it one mark a vertex: twice the round it was a candidate in, and one if it was
 * reached. */
typedef struct flg_search {
    flg_candidates candidates;
    uint32_t to_visit[FLG_CANDIDATES + 1];
    uint32_t found[FLG_TERMS];
    size_t found_count;
    double points[3][FLG_TERMS + 1 + 3]; /* the vertex and its neighbours, in axes of their own; a row an axis */
    double matrix[FLG_ROWS][FLG_STRIDE];
    double* rows[FLG_ROWS];
    uint32_t round;
    uint32_t* marks;
} flg_search;

size_t flg_fit_scratch_bytes(uint32_t count) {
    const uint64_t bytes = sizeof(flg_search) + (uint64_t)count * sizeof(uint32_t);
    return bytes < SIZE_MAX ? (size_t)bytes : SIZE_MAX;
}

/* Marks the candidates that edges between candidates connect with `own`. */
static FLG_COLD void reach(const flg_fit* fit, uint32_t own, flg_search* search) {
    const uint32_t candidate = 2 * ++search->round;
    size_t waiting = 0;
    for (size_t k = 0; k < search->candidates.count; ++k) search->marks[search->candidates.found[k].value] = candidate;
    search->marks[own] = candidate + 1;
    search->to_visit[waiting++] = own;
    while (waiting > 0) {
        const uint32_t v = search->to_visit[--waiting];
        for (size_t k = fit->link_starts[v]; k < fit->link_starts[(size_t)v + 1]; ++k) {
            const uint32_t w = fit->links[k];
            if (search->marks[w] != candidate) continue;
            search->marks[w] = candidate + 1;
            search->to_visit[waiting++] = w;
        }
    }
}

/* Not so where one lies in front of the other's surface. Vertices without a face have no front. */
static FLG_COLD int has_matter_between(const flg_fit* fit, uint32_t a, uint32_t b) {
    const float *p = fit->rest + 3 * (size_t)a, *q = fit->rest + 3 * (size_t)b;
    const float *n = fit->normals + 3 * (size_t)a, *m = fit->normals + 3 * (size_t)b;
    double way[3], across;
    for (int k = 0; k < 3; ++k) way[k] = (double)q[k] - (double)p[k];
    across = (double)FLG_ACROSS * sqrt(dot(way, way));
    return (double)n[0] * way[0] + (double)n[1] * way[1] + (double)n[2] * way[2] <= across &&
           (double)m[0] * way[0] + (double)m[1] * way[1] + (double)m[2] * way[2] >= -across;
}

static int counts_as_neighbour(const flg_fit* fit, const flg_search* search, uint32_t own, uint32_t v) {
    return v != own && (search->marks[v] == 2 * search->round + 1 || has_matter_between(fit, own, v));
}

static FLG_COLD void find_neighbours(const flg_fit* fit, uint32_t vertex, flg_search* search) {
    const uint32_t own = fit->place[vertex];
    const flg_part* part = fit->parts + fit->part_of[own];
    const float* point = fit->rest + 3 * (size_t)own;
    size_t near_count;
    search->found_count = 0;
    find_nearest(&part->all, point, FLG_TRIED * FLG_NEAR, &search->candidates);
    reach(fit, own, search);
    make_heap(&search->candidates);
    while (search->candidates.count > 0 && search->found_count < FLG_NEAR) {
        const uint32_t v = take_nearest(&search->candidates);
        if (counts_as_neighbour(fit, search, own, v)) search->found[search->found_count++] = v;
    }
    near_count = search->found_count;
    find_nearest(&part->some, point, FLG_TRIED * FLG_FAR + FLG_NEAR, &search->candidates);
    make_heap(&search->candidates);
    while (search->candidates.count > 0 && search->found_count < near_count + FLG_FAR) {
        const uint32_t v = take_nearest(&search->candidates);
        int is_found = 0;
        for (size_t i = 0; i < near_count; ++i) is_found |= search->found[i] == v;
        if (!is_found && counts_as_neighbour(fit, search, own, v)) search->found[search->found_count++] = v;
    }
}

/* ---- Weights ---- */

/* Eigenvalues and unit eigenvectors (columns) of a symmetric matrix, the largest first, by Jacobi rotations. */
static FLG_COLD void symmetric_eigen(double a[3][3], double values[3], double vectors[3][3]) {
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) vectors[i][j] = i == j;
    for (int sweep = 0; sweep < 40 && (a[0][1] != 0 || a[0][2] != 0 || a[1][2] != 0); ++sweep)
        for (int p = 0; p < 2; ++p)
            for (int q = p + 1; q < 3; ++q) {
                const int r = 3 - p - q;
                double theta, t, c, s, x, y;
                if (a[p][q] == 0) continue;
                theta = (a[q][q] - a[p][p]) / (2 * a[p][q]);
                t = (theta < 0 ? -1 : 1) / (fabs(theta) + sqrt(theta * theta + 1));
                c = 1 / sqrt(t * t + 1);
                s = t * c;
                a[p][p] -= t * a[p][q];
                a[q][q] += t * a[p][q];
                a[p][q] = a[q][p] = 0;
                x = a[r][p];
                y = a[r][q];
                a[r][p] = a[p][r] = c * x - s * y;
                a[r][q] = a[q][r] = s * x + c * y;
                for (int k = 0; k < 3; ++k) {
                    x = vectors[k][p];
                    y = vectors[k][q];
                    vectors[k][p] = c * x - s * y;
                    vectors[k][q] = s * x + c * y;
                }
            }
    for (int k = 0; k < 3; ++k) values[k] = a[k][k];
    for (int pass = 0; pass < 2; ++pass)
        for (int k = 0; k < 2 - pass; ++k)
            if (values[k] < values[k + 1]) {
                const double value = values[k];
                values[k] = values[k + 1];
                values[k + 1] = value;
                for (int i = 0; i < 3; ++i) {
                    const double entry = vectors[i][k];
                    vectors[i][k] = vectors[i][k + 1];
                    vectors[i][k + 1] = entry;
                }
            }
}

/* 0 up to `from`, 1 from `to` on, between them a cubic without slope at either end. */
static double smoothstep(double from, double to, double x) {
    double t;
    if (x >= to) return 1;
    if (x <= from) return 0;
    t = (x - from) / (to - from);
    return t * t * (3 - 2 * t);
}

/* A vertex and its neighbours in axes of their own: along which they spread most first, about the vertex, in units of
 * their size. */
typedef struct flg_neighbourhood {
    double size;       /* root of the mean squared distance from the mean */
    double axes[3][3]; /* columns */
    double spread[3];  /* root of the mean square along each axis, in sizes */
    size_t count;
    int rank; /* directions with a linear term */
} flg_neighbourhood;

/* The set's points go to search->points. size 0: they are all at one place. */
static FLG_COLD void make_neighbourhood(const flg_fit* fit, uint32_t vertex, flg_search* search,
                                        flg_neighbourhood* set) {
    const float* centre = fit->rest + 3 * (size_t)vertex;
    double mean[3], covariance[3][3], values[3];
    set->count = search->found_count + 1;
    for (int k = 0; k < 3; ++k) {
        double* x = search->points[k];
        mean[k] = x[0] = 0;
        for (size_t i = 1; i < set->count; ++i) {
            x[i] = (double)fit->rest[3 * (size_t)search->found[i - 1] + (size_t)k] - (double)centre[k];
            mean[k] += x[i];
        }
        mean[k] /= (double)set->count;
    }
    for (int a = 0; a < 3; ++a)
        for (int b = 0; b <= a; ++b) {
            double sum = 0;
            for (size_t i = 0; i < set->count; ++i)
                sum += (search->points[a][i] - mean[a]) * (search->points[b][i] - mean[b]);
            covariance[a][b] = covariance[b][a] = sum / (double)set->count;
        }
    set->size = sqrt(covariance[0][0] + covariance[1][1] + covariance[2][2]);
    if (!(set->size > 0)) return;
    for (int a = 0; a < 3; ++a)
        for (int b = 0; b < 3; ++b) covariance[a][b] /= set->size * set->size;
    symmetric_eigen(covariance, values, set->axes);
    for (int k = 0; k < 3; ++k) set->spread[k] = values[k] > 0 ? sqrt(values[k]) : 0;
    for (size_t i = 0; i < set->count; ++i) {
        const double x = search->points[0][i], y = search->points[1][i], z = search->points[2][i];
        for (int k = 0; k < 3; ++k)
            search->points[k][i] = (set->axes[0][k] * x + set->axes[1][k] * y + set->axes[2][k] * z) / set->size;
    }
    set->rank = set->spread[1] < FLG_NO_SPREAD * set->spread[0]   ? 1
                : set->spread[2] < FLG_NO_SPREAD * set->spread[1] ? 2
                                                                  : 3;
}

/* The equations of the interpolant, three right sides behind them: what gives the gradient at the first point. */
static FLG_COLD size_t make_equations(const flg_neighbourhood* set, flg_search* search) {
    const size_t n = set->count, rank = (size_t)set->rank, size = n + 1 + rank;
    const double *x = search->points[0], *y = search->points[1], *z = search->points[2];
    memset(search->matrix, 0, size * sizeof search->matrix[0]);
    for (size_t a = 0; a < n; ++a) {
        double* row = search->matrix[a];
        const double length = sqrt(x[a] * x[a] + y[a] * y[a] + z[a] * z[a]);
        for (size_t b = 0; b <= a; ++b) {
            const double dx = x[a] - x[b], dy = y[a] - y[b], dz = z[a] - z[b], squared = dx * dx + dy * dy + dz * dz,
                         product = x[a] * x[b] + y[a] * y[b] + z[a] * z[b];
            row[b] = squared * sqrt(squared) + FLG_QUADRATICS * product * product;
        }
        for (size_t b = 0; b < a; ++b) search->matrix[b][a] = row[b];
        row[a] += FLG_RIDGE;
        row[n] = search->matrix[n][a] = 1;
        for (size_t k = 0; k < rank; ++k) row[n + 1 + k] = search->matrix[n + 1 + k][a] = search->points[k][a];
        for (size_t k = 0; k < 3; ++k) row[size + k] = -3 * length * search->points[k][a];
    }
    for (size_t k = 0; k < rank; ++k) search->matrix[n + 1 + k][size + k] = 1;
    return size;
}

/* Solves by elimination with partial pivoting; the results are where the right sides were, in rows[i][size + k]. */
static FLG_COLD void solve_equations(size_t size, const flg_kernel* kernel, flg_search* search) {
    double** rows = search->rows;
    for (size_t i = 0; i < size; ++i) rows[i] = search->matrix[i];
    for (size_t c = 0; c < size; ++c) {
        /* Groups of four: the columns of the first group that are done already are not read any more. */
        const size_t begin = (c + 1) / 4 * 4, count = (size + 3 - begin + 3) / 4 * 4;
        size_t pivot = c;
        double* moved;
        for (size_t r = c + 1; r < size; ++r)
            if (fabs(rows[r][c]) > fabs(rows[pivot][c])) pivot = r;
        moved = rows[c];
        rows[c] = rows[pivot];
        rows[pivot] = moved;
        if (rows[c][c] == 0) continue;
        for (size_t r = c + 1; r < size; ++r) {
            const double factor = rows[r][c] / rows[c][c];
            if (factor != 0) kernel->subtract_row(rows[r] + begin, rows[c] + begin, factor, count);
        }
    }
    for (size_t r = size; r-- > 0;)
        for (size_t k = 0; k < 3; ++k) {
            double sum = rows[r][size + k];
            for (size_t c = r + 1; c < size; ++c) sum -= rows[r][c] * rows[c][size + k];
            rows[r][size + k] = rows[r][r] != 0 ? sum / rows[r][r] : 0;
        }
}

static float completed_share(const flg_neighbourhood* set, int axis) {
    if (set->rank < axis + 1) return 1;
    return (float)(1 - smoothstep(FLG_FLAT, FLG_SOLID, set->spread[axis] / set->spread[axis - 1]));
}

static void set_identity(float a[9]) {
    for (int k = 0; k < 9; ++k) a[k] = k % 4 == 0 ? 1.0f : 0.0f;
}

static FLG_COLD void solve_vertex(flg_fit* fit, uint32_t vertex, flg_search* search) {
    flg_terms* terms = fit->terms + vertex;
    flg_flatness* flatness = fit->flatness + vertex;
    float* rest_error = fit->rest_error + 9 * (size_t)vertex;
    flg_neighbourhood set;
    size_t size;
    memset(flatness, 0, sizeof *flatness);
    set_identity(rest_error);
    memset(terms, 0, sizeof *terms);
    find_neighbours(fit, vertex, search);
    make_neighbourhood(fit, vertex, search, &set);
    if (!(set.size > 0)) return;
    size = make_equations(&set, search);
    solve_equations(size, fit->kernel, search);
    terms->count = (uint32_t)search->found_count;
    for (size_t i = 0; i < search->found_count; ++i) {
        const double* solved = search->rows[i + 1] + size;
        terms->vertices[i] = search->found[i];
        for (int k = 0; k < 3; ++k)
            terms->weights[i][k] =
                (set.axes[k][0] * solved[0] + set.axes[k][1] * solved[1] + set.axes[k][2] * solved[2]) / set.size;
    }
    for (int k = 0; k < 3; ++k) {
        flatness->line[k] = (float)set.axes[k][0];
        flatness->normal[k] = (float)set.axes[k][2];
    }
    flatness->beside_line = completed_share(&set, 1);
    flatness->off_plane = completed_share(&set, 2);
    for (int row = 0; row < 3; ++row)
        for (int column = 0; column < 3; ++column) {
            double sum = 0; /* what the directions with a linear term span */
            for (int k = 0; k < set.rank; ++k) sum += set.axes[row][k] * set.axes[column][k];
            rest_error[3 * column + row] = (float)sum;
        }
}

void flg_fit_solve(flg_fit* fit, uint32_t begin, uint32_t end, void* scratch) {
    flg_search* search = (flg_search*)scratch;
    search->round = 0;
    search->marks = (uint32_t*)(search + 1);
    memset(search->marks, 0, (size_t)fit->count * sizeof(uint32_t));
    for (uint32_t v = begin; v < end; ++v) solve_vertex(fit, v, search);
}

/* ---- Poses ---- */

/* The sum over a vertex's neighbours, column by column. */
static void sum_terms(const flg_fit* fit, const float* positions, uint32_t vertex, float gradient[9]) {
    const flg_terms* terms = fit->terms + vertex;
    double rows[12];
    fit->kernel->sum_terms(terms->weights[0], terms->vertices, terms->count, positions, positions + 3 * (size_t)vertex,
                           rows);
    for (int k = 0; k < 9; ++k) gradient[k] = (float)rows[k % 3 * 4 + k / 3];
}

void flg_fit_end(flg_fit* fit) {
    for (uint32_t v = 0; v < fit->count; ++v) {
        float at_rest[9];
        sum_terms(fit, fit->rest, v, at_rest);
        for (int k = 0; k < 9; ++k) fit->rest_error[9 * (size_t)v + (size_t)k] -= at_rest[k];
    }
    free_search(fit);
}

static void unit_across(const double n[3], double across[3]) {
    const double x = fabs(n[0]), y = fabs(n[1]), z = fabs(n[2]);
    double axis[3] = {0, 0, 0}, length;
    axis[x <= y && x <= z ? 0 : y <= z ? 1 : 2] = 1;
    flg_cross(n, axis, across);
    length = sqrt(dot(across, across));
    for (int k = 0; k < 3; ++k) across[k] /= length;
}

/* a x, for a that has column after column. */
static void transform(const double a[9], const double x[3], double out[3]) {
    for (int row = 0; row < 3; ++row) out[row] = a[row] * x[0] + a[3 + row] * x[1] + a[6 + row] * x[2];
}

/* a with what it does to the unit vector n replaced by s n': n' and s from what a does to the plane across n. */
FLG_APART void with_normal_column(const double a[9], const double n[3], double out[9]) {
    double t[3], b[3], moved_t[3], moved_b[3], across[3], moved_n[3], area;
    unit_across(n, t);
    flg_cross(n, t, b);
    transform(a, t, moved_t);
    transform(a, b, moved_b);
    flg_cross(moved_t, moved_b, across); /* the deformed normal; its length is the area ratio */
    area = sqrt(dot(across, across));
    transform(a, n, moved_n);
    for (int row = 0; row < 3; ++row) {
        const double column = area > 0 ? sqrt(area) * across[row] / area : 0;
        for (int c = 0; c < 3; ++c) out[3 * c + row] = a[3 * c + row] + (column - moved_n[row]) * n[c];
    }
}

/* The least rotation that takes the unit vector a to the unit vector b, by half its angle: they are of length 1 to the
 * last bits, or turns by nearly 180 degrees go wrong. */
FLG_APART void least_rotation(const double a[3], const double b[3], double out[9]) {
    const double cosine = dot(a, b);
    double v[3], w;
    if (cosine < -1 + 1e-12) { /* a half turn about any axis across */
        unit_across(a, v);
        for (int c = 0; c < 3; ++c)
            for (int row = 0; row < 3; ++row) out[3 * c + row] = 2 * v[row] * v[c] - (row == c);
        return;
    }
    w = sqrt((1 + cosine) / 2); /* a quaternion */
    flg_cross(a, b, v);
    for (int k = 0; k < 3; ++k) v[k] /= 2 * w;
    for (int c = 0; c < 3; ++c) {
        const int d = (c + 1) % 3, e = (c + 2) % 3;
        out[3 * c + c] = 1 - 2 * (v[d] * v[d] + v[e] * v[e]);
        out[3 * c + d] = 2 * (v[c] * v[d] + w * v[e]);
        out[3 * c + e] = 2 * (v[c] * v[e] - w * v[d]);
    }
}

/* a with what it does across the unit vector t replaced by the least rotation that takes t to a t, scaled like a t. */
FLG_APART void turned_with_line(const double a[9], const double t[3], double out[9]) {
    double moved[3], stretch, length, from[3], to[3], turn[9];
    transform(a, t, moved);
    stretch = sqrt(dot(moved, moved));
    for (int c = 0; c < 3; ++c)
        for (int row = 0; row < 3; ++row) out[3 * c + row] = moved[row] * t[c];
    if (!(stretch > 0)) return;
    length = sqrt(dot(t, t));
    for (int k = 0; k < 3; ++k) {
        from[k] = t[k] / length;
        to[k] = moved[k] / stretch;
    }
    least_rotation(from, to, turn);
    for (int c = 0; c < 3; ++c) {
        double across[3], turned[3];
        for (int row = 0; row < 3; ++row) across[row] = (row == c) - t[row] * t[c];
        transform(turn, across, turned);
        for (int row = 0; row < 3; ++row) out[3 * c + row] += stretch * turned[row];
    }
}

FLG_APART void complete(float gradient[9], const flg_flatness* flatness) {
    double a[9], other[9], direction[3];
    if (flatness->off_plane == 0) return;
    for (int k = 0; k < 9; ++k) a[k] = (double)gradient[k];
    if (flatness->beside_line > 0) {
        for (int k = 0; k < 3; ++k) direction[k] = (double)flatness->line[k];
        turned_with_line(a, direction, other);
        for (int k = 0; k < 9; ++k) a[k] += (double)flatness->beside_line * (other[k] - a[k]);
    }
    for (int k = 0; k < 3; ++k) direction[k] = (double)flatness->normal[k];
    with_normal_column(a, direction, other);
    for (int k = 0; k < 9; ++k) gradient[k] = (float)(a[k] + (double)flatness->off_plane * (other[k] - a[k]));
}

void flg_fit_gradients(const flg_fit* fit, const float* positions, uint32_t begin, uint32_t end, float* gradients) {
    for (uint32_t v = begin; v < end; ++v) {
        float* gradient = gradients + 9 * (size_t)v;
        sum_terms(fit, positions, v, gradient);
        for (int k = 0; k < 9; ++k) gradient[k] += fit->rest_error[9 * (size_t)v + (size_t)k];
        complete(gradient, fit->flatness + v);
    }
}

#ifdef FLG_WITH_FIT_TERMS
void flg_fit_terms_of(const flg_fit* fit, uint32_t vertex, flg_fit_terms* out) {
    const flg_terms* terms = fit->terms + vertex;
    const flg_flatness* flatness = fit->flatness + vertex;
    out->count = terms->count;
    for (uint32_t j = 0; j < terms->count; ++j) {
        out->vertices[j] = terms->vertices[j];
        for (int k = 0; k < 3; ++k) out->weights[j][k] = terms->weights[j][k];
    }
    memcpy(out->constant, fit->rest_error + 9 * (size_t)vertex, sizeof out->constant);
    memcpy(out->line, flatness->line, sizeof out->line);
    memcpy(out->normal, flatness->normal, sizeof out->normal);
    out->beside_line = flatness->beside_line;
    out->off_plane = flatness->off_plane;
}
#endif

#else

/* Nobody begins a fit: no model has one. */
flg_fit* flg_fit_begin(const float* rest, uint32_t count, const flg_faces* faces, const flg_kernel* kernel,
                       const flg_allocator* allocator) {
    (void)rest, (void)count, (void)faces, (void)kernel, (void)allocator;
    return NULL;
}
size_t flg_fit_scratch_bytes(uint32_t count) { return count; }
void flg_fit_solve(flg_fit* fit, uint32_t begin, uint32_t end, void* scratch) {
    (void)fit, (void)begin, (void)end, (void)scratch;
}
void flg_fit_end(flg_fit* fit) { (void)fit; }
void flg_fit_free(flg_fit* fit) { (void)fit; }
void flg_fit_gradients(const flg_fit* fit, const float* positions, uint32_t begin, uint32_t end, float* gradients) {
    (void)fit, (void)positions, (void)begin, (void)end, (void)gradients;
}

#endif
