/* Models: the file's container, opening, and what is restored from. docs/fil-format.md has every byte of a file. */
#include "filigree_rt.h"
#include "rt_code.h"
#include "rt_fit.h"
#include "rt_hash.h"

#include <math.h>
#include <string.h>

enum {
    FLG_FILE_VERSION = 2,
    FLG_HEADER = 32, /* bytes */
    FLG_ENTRY = 40,
    FLG_CHUNK = 1 << 18, /* vertices of a chunk, eight blocks */
    FLG_MOST_LEVELS = 64,
    FLG_ALIGNMENT = 64
};
static const uint32_t FLG_NO_INDEX = 0xffffffffu;

/* What is restored together: positions and normals of the vertices, or normals of corners alone. One record a slot, in
 * blocks of FLG_BLOCK slots. */
typedef struct flg_record_set {
    flg_records records;
    uint32_t slots, blocks;
    uint32_t* block_runs; /* the first run of each block, and the end */
    uint16_t* from;       /* of each slot: which record of its block goes there */
    int has_normals;
} flg_record_set;

/* Where a frame's sections lie in the file. */
typedef struct flg_frame {
    uint64_t positions, position_hash, gradients, gradient_hash;
    int has_positions, has_gradients;
    const void *decoded_positions, *decoded_gradients; /* of a packed model */
} flg_frame;

/* Memory of the model, one piece behind another; the piece's bytes follow. */
typedef struct flg_piece {
    struct flg_piece* next;
    uint64_t aligned;
} flg_piece;

struct flg_model {
    flg_allocator allocator;
    flg_piece* pieces;
    const flg_kernel* kernel;
    flg_info info;
    size_t file_size;
    uint64_t table_hash;
    int checks_hashes;
    uint32_t* cells;
    float* driver_rest;
    double* inner_rest; /* relative to the centre and scaled */
    double inner_scale, centre[3];
    uint32_t *driver_triangles, *triangles, *triangle_uvs, *triangle_normals, *triangle_faces, *level_vertices;
    flg_record_set vertices, corner_normals;
    flg_fit* fit;
    flg_frame* frames;
    flg_plain_section* decoded; /* of a packed model: what it says beside faces, places and records */
};

static const char* const status_texts[] = {
    "Done.",
    "There is not enough memory.",
    "The bytes are no model of Filigree.",
    "The model is damaged: it is cut off, its checksums are wrong, or its numbers contradict each other.",
    "The model was written by a later version of Filigree; use a later runtime.",
    "The model cannot be restored as it is: unpack it, or strip its mesh again with the blend code.",
    "An argument is NULL or out of its range.",
    "The pose has another number of driver vertices than the model.",
    "The model does not have what is asked for.",
    "The model has int16 records, which are no longer read: strip the mesh again, and pack it for the runtime.",
};

const char* flg_status_text(flg_status status) {
    return (unsigned)status < sizeof status_texts / sizeof status_texts[0] ? status_texts[status] : "Unknown status.";
}

uint32_t flg_abi(void) { return FLG_ABI; }

/* ---- The container ---- */

typedef struct flg_file {
    const unsigned char* bytes;
    size_t size;
    uint32_t sections;
    uint64_t table_hash;
    int checks_hashes, is_packed;
} flg_file;

typedef struct flg_section {
    char name[8];
    uint32_t index, item;
    uint64_t offset, count, hash;
} flg_section;

static flg_section section_at(const flg_file* file, uint32_t k) {
    flg_section section;
    memcpy(&section, file->bytes + FLG_HEADER + (size_t)FLG_ENTRY * k, FLG_ENTRY);
    return section;
}

static void make_key(const char* name, char key[8]) {
    memset(key, 0, 8);
    for (int k = 0; k < 8 && name[k]; ++k) key[k] = name[k];
}

/* The first section of that name and index. */
static int find_section(const flg_file* file, const char* name, uint32_t index, flg_section* found) {
    char key[8];
    make_key(name, key);
    for (uint32_t k = 0; k < file->sections; ++k) {
        *found = section_at(file, k);
        if (found->index == index && memcmp(found->name, key, 8) == 0) return 1;
    }
    return 0;
}

static flg_status read_container(const void* bytes, size_t size, flg_file* file) {
    uint32_t version;
    uint64_t told, end;
    flg_section ignored;
    file->bytes = (const unsigned char*)bytes;
    file->size = size;
    file->checks_hashes = 1;
    if (size < 8 || memcmp(bytes, "FILIGREE", 8) != 0) return FLG_NOT_A_MODEL;
    if (size < FLG_HEADER) return FLG_DAMAGED;
    memcpy(&version, file->bytes + 8, sizeof version);
    memcpy(&file->sections, file->bytes + 12, sizeof file->sections);
    memcpy(&told, file->bytes + 16, sizeof told);
    memcpy(&file->table_hash, file->bytes + 24, sizeof file->table_hash);
    if (version > FLG_FILE_VERSION) return FLG_NEWER;
    if (version == 1) return FLG_UNSUITABLE;
    if (version == 0 || told != size || file->sections > (size - FLG_HEADER) / FLG_ENTRY) return FLG_DAMAGED;
    end = FLG_HEADER + (uint64_t)FLG_ENTRY * file->sections;
    if (hash_of(file->bytes + FLG_HEADER, (size_t)end - FLG_HEADER) != file->table_hash) return FLG_DAMAGED;
    for (uint32_t k = 0; k < file->sections; ++k) { /* no two share bytes: together they need no more than the file */
        const flg_section section = section_at(file, k);
        if (section.offset < end || section.offset > size || section.item == 0 ||
            section.count > (size - section.offset) / section.item)
            return FLG_DAMAGED;
        end = section.offset + section.count * section.item;
    }
    file->is_packed = find_section(file, "rt.par", 0, &ignored);
    return find_section(file, "cd.par", 0, &ignored) || find_section(file, "ll.tab", 0, &ignored) ? FLG_UNSUITABLE
                                                                                                  : FLG_OK;
}

static int has_its_hash(const flg_file* file, const flg_section* section) {
    return !file->checks_hashes ||
           hash_of(file->bytes + section->offset, (size_t)(section->count * section->item)) == section->hash;
}

flg_status flg_find_section(const void* bytes, size_t size, const char* name, uint32_t index, const void** items,
                            uint32_t* item_size, size_t* count) {
    flg_file file;
    flg_section section;
    flg_status status;
    if (!bytes || !name || !items || !item_size || !count || strlen(name) > 8) return FLG_ARGUMENT;
    *items = NULL;
    *item_size = 0;
    *count = 0;
    status = read_container(bytes, size, &file);
    if (status != FLG_OK) return status;
    if (!find_section(&file, name, index, &section)) return FLG_MISSING;
    if (section.offset % 8 != 0 || !has_its_hash(&file, &section)) return FLG_DAMAGED;
    *items = file.bytes + section.offset;
    *item_size = section.item;
    *count = (size_t)section.count;
    return FLG_OK;
}

/* ---- Opening ---- */

/* The first thing that goes wrong stays in `status`; what follows it does nothing. */
typedef struct flg_opening {
    flg_file file;
    flg_model* model;
    flg_piece* scratch;         /* until opening ends */
    flg_plain_section* decoded; /* what the streams of a packed model stand for */
    uint32_t flags;
    flg_status status;
    uint32_t all_vertices;         /* in the file: with those of a driver behind the mesh's own */
    const float* positions;        /* of all vertices, at rest */
    uint32_t* record_of;           /* of each vertex: its record in the file's order */
    uint32_t *vertex_of, *cell_of; /* of each record */
    const float *u, *v;            /* weights, in the file's order */
    flg_faces faces;               /* of the level that is opened */
    uint32_t corner_count;
} flg_opening;

static FLG_COLD int fails(flg_opening* o, flg_status status) {
    if (o->status == FLG_OK) o->status = status;
    return o->status != FLG_OK;
}
static FLG_COLD int needs(flg_opening* o, int holds) { return holds ? o->status == FLG_OK : !fails(o, FLG_DAMAGED); }

static FLG_COLD void* take_piece(flg_opening* o, flg_piece** pieces, uint64_t count, size_t item) {
    flg_piece* piece = NULL;
    if (o->status != FLG_OK) return NULL;
    if (count <= (uint64_t)(PTRDIFF_MAX / 2 - (ptrdiff_t)sizeof(flg_piece)) / item)
        piece = (flg_piece*)flg_allocate(&o->model->allocator, 1, sizeof(flg_piece) + (size_t)count * item);
    if (!piece) {
        fails(o, FLG_NO_MEMORY);
        return NULL;
    }
    piece->next = *pieces;
    *pieces = piece;
    return piece + 1;
}
/* Memory of the model, and memory until opening ends; NULL after an error. */
static FLG_COLD void* keep(flg_opening* o, uint64_t count, size_t item) {
    return take_piece(o, &o->model->pieces, count, item);
}
static FLG_COLD void* borrow(flg_opening* o, uint64_t count, size_t item) {
    return take_piece(o, &o->scratch, count, item);
}

static FLG_COLD void release_pieces(const flg_allocator* allocator, flg_piece* piece) {
    while (piece) {
        flg_piece* next = piece->next;
        flg_release(allocator, piece);
        piece = next;
    }
}

static FLG_COLD const flg_plain_section* find_decoded(const flg_plain_section* from, const char* name, uint32_t index) {
    char key[8];
    make_key(name, key);
    while (from && (from->index != index || memcmp(from->name, key, 8) != 0)) from = from->next;
    return from;
}

/* How many items a section has; 0 where it is missing. */
static FLG_COLD uint64_t section_count(flg_opening* o, const char* name, uint32_t index, uint32_t item) {
    flg_section section;
    const flg_plain_section* decoded = find_decoded(o->decoded, name, index);
    if (decoded) return needs(o, decoded->item == item) ? decoded->count : 0;
    if (o->status != FLG_OK || !find_section(&o->file, name, index, &section)) return 0;
    needs(o, section.item == item);
    return o->status == FLG_OK ? section.count : 0;
}

/* Copies all items of a section to memory that has room for them. */
static FLG_COLD void copy_section(flg_opening* o, const char* name, uint32_t index, void* to) {
    flg_section section;
    const flg_plain_section* decoded = find_decoded(o->decoded, name, index);
    if (decoded && o->status == FLG_OK) memcpy(to, decoded->items, (size_t)(decoded->count * decoded->item));
    if (decoded) return;
    if (o->status != FLG_OK || !find_section(&o->file, name, index, &section)) return;
    if (!needs(o, has_its_hash(&o->file, &section))) return;
    memcpy(to, o->file.bytes + section.offset, (size_t)(section.count * section.item));
}

/* All items of a section, borrowed. */
static FLG_COLD void* read_section(flg_opening* o, const char* name, uint32_t index, uint32_t item, uint64_t* count) {
    void* items;
    const flg_plain_section* decoded = find_decoded(o->decoded, name, index);
    *count = section_count(o, name, index, item);
    if (decoded) return o->status == FLG_OK ? decoded->items : NULL;
    items = borrow(o, *count, item);
    if (items) copy_section(o, name, index, items);
    return items;
}

/* The one item of a section that every model has. */
static FLG_COLD void read_value(flg_opening* o, const char* name, uint32_t item, void* to) {
    memset(to, 0, item);
    if (needs(o, section_count(o, name, 0, item) == 1)) copy_section(o, name, 0, to);
}

static FLG_COLD int all_finite(const float* x, uint64_t count) {
    int finite = 1;
    for (uint64_t k = 0; k < count; ++k) finite &= x[k] <= FLT_MAX && x[k] >= -FLT_MAX;
    return finite;
}

static FLG_COLD uint32_t chunk_count(uint32_t vertices) { return vertices / FLG_CHUNK + (vertices % FLG_CHUNK != 0); }
static FLG_COLD uint32_t block_count(uint32_t slots) { return slots / FLG_BLOCK + (slots % FLG_BLOCK != 0); }
static FLG_COLD uint32_t in_chunk(uint32_t vertices, uint32_t chunk) {
    const uint64_t first = (uint64_t)chunk * FLG_CHUNK;
    return vertices - first < FLG_CHUNK ? (uint32_t)(vertices - first) : (uint32_t)FLG_CHUNK;
}

/* A section in chunks, one item a vertex, to be read alone. */
static FLG_COLD const void* read_chunks(flg_opening* o, const char* name, uint32_t item) {
    const uint32_t chunks = chunk_count(o->all_vertices);
    char* items;
    for (uint32_t k = 0; k < chunks && o->status == FLG_OK; ++k) /* before there is memory for so many */
        needs(o, section_count(o, name, k, item) == in_chunk(o->all_vertices, k));
    if (find_decoded(o->decoded, name, 0)) return o->status == FLG_OK ? find_decoded(o->decoded, name, 0)->items : NULL;
    items = (char*)borrow(o, o->all_vertices, item);
    for (uint32_t k = 0; k < chunks && o->status == FLG_OK; ++k)
        copy_section(o, name, k, items + (size_t)k * FLG_CHUNK * item);
    return items;
}

/* Faces whose corners are below `limit`, borrowed. prefix: "mesh" or "lev". */
static FLG_COLD void read_faces(flg_opening* o, const char* prefix, uint32_t index, uint32_t limit, flg_faces* faces,
                                uint32_t* corner_count) {
    char name[9];
    uint64_t corners, sizes, offsets;
    uint32_t *size, *offset, *corner;
    const size_t length = strlen(prefix);
    memset(faces, 0, sizeof *faces);
    *corner_count = 0;
    memcpy(name, prefix, length);
    memcpy(name + length, ".cor", 5);
    corner = (uint32_t*)read_section(o, name, index, 4, &corners);
    memcpy(name + length, ".siz", 5);
    size = (uint32_t*)read_section(o, name, index, 4, &sizes);
    memcpy(name + length, ".off", 5);
    offset = (uint32_t*)read_section(o, name, index, 4, &offsets);
    if (!needs(o, corners < FLG_NO_INDEX)) return;
    if (sizes > 0) {
        if (!needs(o, sizes == 1 && size[0] > 0 && corners % size[0] == 0 && (corners == 0 || size[0] >= 3))) return;
        faces->count = (size_t)(corners / size[0]);
        if (size[0] != 3) {
            offset = (uint32_t*)borrow(o, (uint64_t)faces->count + 1, 4);
            for (size_t f = 0; offset && f <= faces->count; ++f) offset[f] = (uint32_t)(f * size[0]);
            faces->offsets = offset;
        }
    } else if (offsets > 0) {
        if (!needs(o, offset[0] == 0 && offset[offsets - 1] == corners)) return;
        faces->count = (size_t)offsets - 1;
        for (size_t f = 0; f < faces->count; ++f)
            if (!needs(o, offset[f + 1] >= offset[f] && offset[f + 1] - offset[f] >= 3)) return;
        faces->offsets = offset;
    } else if (!needs(o, corners == 0)) {
        return;
    }
    for (uint64_t c = 0; c < corners; ++c)
        if (!needs(o, corner[c] < limit)) return;
    faces->corners = corner;
    *corner_count = (uint32_t)corners;
}

/* Fans: 3 of `values`, which has an item a corner (NULL: the corner's number), for each triangle. */
static FLG_COLD uint32_t* make_fans(flg_opening* o, const flg_faces* faces, const uint32_t* values,
                                    uint32_t triangles) {
    uint32_t* to = (uint32_t*)keep(o, triangles, 3 * sizeof(uint32_t));
    size_t at = 0;
    for (size_t f = 0; to && f < faces->count; ++f) {
        const uint32_t begin = faces->offsets ? faces->offsets[f] : (uint32_t)(3 * f),
                       end = faces->offsets ? faces->offsets[f + 1] : begin + 3;
        for (uint32_t c = begin + 1; c + 1 < end; ++c) {
            to[at++] = values[begin];
            to[at++] = values[c];
            to[at++] = values[c + 1];
        }
    }
    return to;
}

static FLG_COLD void make_triangles(flg_opening* o) {
    flg_model* model = o->model;
    const uint32_t triangles = model->info.triangles;
    if (o->flags & FLG_WITHOUT_TRIANGLES) return;
    model->triangles = make_fans(o, &o->faces, o->faces.corners, triangles);
    if (o->faces.offsets) {
        size_t at = 0;
        model->triangle_faces = (uint32_t*)keep(o, triangles, sizeof(uint32_t));
        for (size_t f = 0; model->triangle_faces && f < o->faces.count; ++f)
            for (uint32_t c = o->faces.offsets[f] + 2; c < o->faces.offsets[f + 1]; ++c)
                model->triangle_faces[at++] = (uint32_t)f;
    }
    if (model->info.level + 1 == model->info.levels) {
        uint64_t count;
        const uint32_t* uvs = (const uint32_t*)read_section(o, "uv.cor", 0, 4, &count);
        if (count > 0 && needs(o, count == o->corner_count)) {
            const uint64_t values = section_count(o, "uv.val", 0, 8);
            for (uint64_t c = 0; c < count; ++c)
                if (!needs(o, uvs[c] < values || uvs[c] == FLG_NO_INDEX)) return;
            model->triangle_uvs = make_fans(o, &o->faces, uvs, triangles);
        }
    }
}

/* ---- The driver ---- */

static FLG_COLD void read_driver(flg_opening* o, uint32_t* cell_count) {
    flg_model* model = o->model;
    uint64_t count, cells, behind;
    const uint32_t* vertices = (const uint32_t*)read_section(o, "lev.vert", 0, 4, &count);
    flg_faces faces;
    uint32_t corners;
    if (!needs(o, count > 0 && count <= o->all_vertices)) return;
    for (uint64_t i = 0; i < count; ++i)
        if (!needs(o, vertices[i] < o->all_vertices && (i == 0 || vertices[i] > vertices[i - 1]))) return;
    model->info.driver_vertices = (uint32_t)count;
    behind = section_count(o, "mesh.drv", 0, 4);
    if (behind > 0) {
        if (!needs(o, model->info.levels == 2 && vertices[0] == o->all_vertices - count)) return;
        model->info.vertices = o->all_vertices - (uint32_t)count; /* of the finest level */
    }
    read_faces(o, "lev", 0, (uint32_t)count, &faces, &corners);
    for (size_t f = 0; faces.offsets && f < faces.count; ++f)
        if (!needs(o, faces.offsets[f + 1] - faces.offsets[f] == 3)) return;
    model->info.driver_triangles = (uint32_t)faces.count;
    model->driver_triangles = make_fans(o, &faces, faces.corners, (uint32_t)faces.count);
    cells = section_count(o, "bl.cell", 0, 12);
    if (!needs(o, cells > 0 && cells < FLG_NO_INDEX)) return;
    model->cells = (uint32_t*)keep(o, cells, 12);
    if (!model->cells) return;
    copy_section(o, "bl.cell", 0, model->cells);
    for (uint64_t k = 0; k < 3 * cells; ++k)
        if (!needs(o, model->cells[k] < count)) return;
    *cell_count = (uint32_t)cells;
    model->driver_rest = (float*)keep(o, count, 3 * sizeof(float));
    if (!model->driver_rest) return;
    o->positions = (const float*)read_chunks(o, "mesh.pos", 12);
    if (!o->positions || !needs(o, all_finite(o->positions, 3 * (uint64_t)o->all_vertices))) return;
    for (uint64_t i = 0; i < count; ++i)
        memcpy(model->driver_rest + 3 * i, o->positions + 3 * (size_t)vertices[i], 3 * sizeof(float));
}

/* ---- Records ---- */

/* Runs of the file: the cell of each of its records. Every block's runs end with it. */
static FLG_COLD void read_runs(flg_opening* o, uint32_t cells) {
    const uint32_t chunks = chunk_count(o->all_vertices);
    o->cell_of = (uint32_t*)borrow(o, o->all_vertices, 4);
    for (uint32_t k = 0; k < chunks && o->status == FLG_OK; ++k) {
        const uint32_t vertices = in_chunk(o->all_vertices, k);
        uint32_t* cell_of = o->cell_of + (size_t)k * FLG_CHUNK;
        uint64_t runs;
        uint32_t done = 0;
        const uint32_t* run = (const uint32_t*)read_section(o, "bl.run", k, 8, &runs);
        for (uint64_t i = 0; i < runs && o->status == FLG_OK; ++i) {
            const uint32_t cell = run[2 * i], count = run[2 * i + 1];
            const uint32_t block_end = done / FLG_BLOCK * FLG_BLOCK + FLG_BLOCK,
                           end = block_end < vertices ? block_end : vertices;
            if (!needs(o, done < vertices && cell < cells && count > 0 && count <= end - done)) return;
            for (uint32_t r = done; r < done + count; ++r) cell_of[r] = cell;
            done += count;
        }
        needs(o, done == vertices);
    }
}

/* Which record is whose. */
static FLG_COLD void read_order(flg_opening* o) {
    const uint16_t* from = (const uint16_t*)read_chunks(o, "bl.from", 2);
    o->record_of = (uint32_t*)borrow(o, o->all_vertices, 4);
    o->vertex_of = (uint32_t*)borrow(o, o->all_vertices, 4);
    if (o->status != FLG_OK) return;
    memset(o->vertex_of, 0xff, (size_t)o->all_vertices * 4);
    for (uint32_t v = 0; v < o->all_vertices; ++v) {
        const uint64_t record = v / FLG_BLOCK * FLG_BLOCK + (uint64_t)from[v];
        if (!needs(o, record < o->all_vertices && record / FLG_BLOCK == v / FLG_BLOCK &&
                          o->vertex_of[record] == FLG_NO_INDEX))
            return;
        o->vertex_of[record] = v;
        o->record_of[v] = (uint32_t)record;
    }
}

static FLG_COLD void read_weights(flg_opening* o) {
    o->u = (const float*)read_chunks(o, "bl.u", 4);
    o->v = (const float*)read_chunks(o, "bl.v", 4);
    for (uint32_t r = 0; o->status == FLG_OK && r < o->all_vertices; ++r)
        needs(o, fabsf(o->u[r]) <= 1 && fabsf(o->v[r]) <= 1);
}

static FLG_COLD void anchor_of(const flg_opening* o, uint32_t record, double m[3]) {
    const uint32_t* cell = o->model->cells + 3 * (size_t)o->cell_of[record];
    const float* rest = o->model->driver_rest;
    flg_anchor(rest + 3 * (size_t)cell[0], rest + 3 * (size_t)cell[1], rest + 3 * (size_t)cell[2], (double)o->u[record],
               (double)o->v[record], m);
}

static FLG_COLD double box_diagonal(const float* points, uint64_t count, double centre[3]) {
    float low[3], high[3];
    double size[3];
    memcpy(low, points, sizeof low);
    memcpy(high, points, sizeof high);
    for (uint64_t i = 1; i < count; ++i)
        for (int k = 0; k < 3; ++k) {
            const float x = points[3 * i + (uint64_t)k];
            if (x < low[k]) low[k] = x;
            if (x > high[k]) high[k] = x;
        }
    for (int k = 0; k < 3; ++k) {
        centre[k] = 0.5 * ((double)low[k] + (double)high[k]);
        size[k] = (double)high[k] - (double)low[k];
    }
    return sqrt(size[0] * size[0] + (size[1] * size[1] + size[2] * size[2]));
}

static FLG_COLD void choose_scale(flg_opening* o) {
    flg_model* model = o->model;
    const uint32_t drivers = model->info.driver_vertices;
    double ignored[3];
    model->inner_rest = (double*)keep(o, drivers, 3 * sizeof(double));
    if (o->status != FLG_OK) return;
    {
        const double driver = box_diagonal(model->driver_rest, drivers, model->centre),
                     all = box_diagonal(o->positions, o->all_vertices, ignored);
        model->inner_scale = flg_inner_scale(driver, all);
    }
    for (size_t i = 0; i < drivers; ++i)
        for (size_t k = 0; k < 3; ++k)
            model->inner_rest[3 * i + k] =
                model->inner_scale * ((double)model->driver_rest[3 * i + k] - model->centre[k]);
}

/* ---- Sets ---- */

/* The set's records, block by block and in a block by cell: the record in the file of each, which goes to `record`, and
 * set->from. vertices: of each slot; NULL: each slot is the vertex of its number. */
static FLG_COLD void order_set(flg_opening* o, flg_record_set* set, const uint32_t* vertices, uint32_t* record) {
    if (!vertices && set->slots == o->all_vertices) { /* as the file has it */
        for (uint32_t v = 0; v < set->slots; ++v) {
            record[v] = v;
            set->from[v] = (uint16_t)(o->record_of[v] % FLG_BLOCK);
        }
        return;
    }
    {
        flg_key* pairs = (flg_key*)borrow(o, 2 * FLG_BLOCK, sizeof(flg_key)); /* by cell and record, the slot of each */
        if (!pairs) return;
        for (uint32_t b = 0; b < set->blocks; ++b) {
            const uint32_t first = b * (uint32_t)FLG_BLOCK,
                           count = set->slots - first < FLG_BLOCK ? set->slots - first : (uint32_t)FLG_BLOCK;
            for (uint32_t k = 0; k < count; ++k) {
                const uint32_t r = o->record_of[vertices ? vertices[first + k] : first + k];
                pairs[k].key = (uint64_t)o->cell_of[r] << 32 | r;
                pairs[k].value = k;
            }
            flg_sort(pairs, pairs + FLG_BLOCK, count);
            for (uint32_t k = 0; k < count; ++k) {
                record[first + k] = (uint32_t)pairs[k].key;
                set->from[first + pairs[k].value] = (uint16_t)k;
            }
        }
    }
}

static FLG_COLD void make_runs(flg_opening* o, flg_record_set* set, const uint32_t* record) {
    uint64_t count = 0;
    flg_run* runs = NULL;
    for (int writing = 0; writing < 2 && o->status == FLG_OK; ++writing) {
        flg_run now = {0, 0, 0};
        count = 0;
        for (uint32_t at = 0; at < set->slots; ++at) {
            const uint32_t cell = o->cell_of[record[at]];
            const int begins_block = at % FLG_BLOCK == 0;
            if (begins_block || cell != now.cell || now.count == FLG_MAX_RUN) {
                if (writing && begins_block) set->block_runs[at / FLG_BLOCK] = (uint32_t)count;
                ++count;
                now.cell = cell;
                now.first = at;
                now.count = 0;
            }
            ++now.count;
            if (writing) runs[count - 1] = now;
        }
        if (writing)
            set->block_runs[set->blocks] = (uint32_t)count;
        else
            runs = (flg_run*)keep(o, count, sizeof(flg_run));
    }
    set->records.runs = runs;
}

static FLG_COLD float* keep_floats(flg_opening* o, uint32_t count) {
    float* made = (float*)keep(o, (uint64_t)count + FLG_PADDING, sizeof(float));
    if (made) memset(made + count, 0, FLG_PADDING * sizeof(float));
    return made;
}
/* u, v, and with positions q. */
static FLG_COLD void fill_records(flg_opening* o, flg_record_set* set, const uint32_t* record, int with_positions) {
    const flg_model* model = o->model;
    flg_records* records = &set->records;
    records->cells = model->cells;
    float *u = keep_floats(o, set->slots), *v = keep_floats(o, set->slots), *q[3] = {NULL, NULL, NULL};
    for (int k = 0; k < 3 && with_positions; ++k) q[k] = keep_floats(o, set->slots);
    if (o->status != FLG_OK) return;
    for (uint32_t at = 0; at < set->slots; ++at) {
        const uint32_t r = record[at];
        u[at] = o->u[r];
        v[at] = o->v[r];
        if (with_positions) {
            double m[3];
            float offset[3];
            anchor_of(o, r, m);
            flg_rest_offset(o->positions + 3 * (size_t)o->vertex_of[r], m, model->centre, model->inner_scale, offset);
            for (int k = 0; k < 3; ++k) q[k][at] = offset[k];
        }
    }
    records->u = u;
    records->v = v;
    for (int k = 0; k < 3; ++k) records->q[k] = q[k];
}

/* vertices: as for order_set. normals: the unit normal of each slot at rest, or NULL. */
static FLG_COLD void make_set(flg_opening* o, flg_record_set* set, uint32_t slots, const uint32_t* vertices,
                              const float* normals, int with_positions) {
    uint32_t* record;
    if (o->status != FLG_OK) return;
    set->slots = slots;
    set->blocks = block_count(slots);
    set->has_normals = normals != NULL;
    set->from = (uint16_t*)keep(o, slots, sizeof(uint16_t));
    set->block_runs = (uint32_t*)keep(o, (uint64_t)set->blocks + 1, sizeof(uint32_t));
    record = (uint32_t*)borrow(o, slots, sizeof(uint32_t));
    if (o->status != FLG_OK) return;
    order_set(o, set, vertices, record);
    make_runs(o, set, record);
    fill_records(o, set, record, with_positions);
    if (normals) {
        float* by_axis[3] = {NULL, NULL, NULL};
        for (int k = 0; k < 3; ++k) by_axis[k] = keep_floats(o, slots);
        if (o->status != FLG_OK) return;
        for (uint32_t slot = 0; slot < slots; ++slot) {
            const size_t at = (size_t)(slot / FLG_BLOCK * FLG_BLOCK) + set->from[slot];
            for (size_t k = 0; k < 3; ++k) by_axis[k][at] = normals[3 * (size_t)slot + k];
        }
        for (int k = 0; k < 3; ++k) set->records.normal[k] = by_axis[k];
    }
}

/* ---- Normals ---- */

/* Values of normals that corners of several vertices share get a copy for each further vertex, behind the others: every
 * value then belongs to one vertex. *values grows to them; vertex_of: of each value. Values that no corner uses are
 * bound to vertex 0, and mean nothing. corners: of the normals; changed to the copies. */
static FLG_COLD float* split_normals(flg_opening* o, const float* values, uint32_t count, uint32_t* corners,
                                     uint32_t** vertex_of, uint32_t* all) {
    uint32_t *first = (uint32_t*)borrow(o, count, sizeof(uint32_t)), *table, *copy_value, *copy_vertex;
    uint64_t shared = 0, slots = 2;
    uint32_t copies = 0;
    float* made;
    if (o->status != FLG_OK) return NULL;
    memset(first, 0xff, (size_t)count * sizeof(uint32_t));
    for (uint32_t c = 0; c < o->corner_count; ++c) {
        const uint32_t value = corners[c];
        if (value == FLG_NO_INDEX) continue;
        if (first[value] == FLG_NO_INDEX) first[value] = o->faces.corners[c];
        shared += first[value] != o->faces.corners[c];
    }
    while (slots < 2 * shared) slots *= 2;
    table = (uint32_t*)borrow(o, slots, sizeof(uint32_t));
    copy_value = (uint32_t*)borrow(o, shared, sizeof(uint32_t));
    copy_vertex = (uint32_t*)borrow(o, shared, sizeof(uint32_t));
    if (o->status != FLG_OK || !needs(o, count + shared < FLG_NO_INDEX)) return NULL;
    memset(table, 0xff, (size_t)slots * sizeof(uint32_t));
    for (uint32_t c = 0; c < o->corner_count; ++c) {
        const uint32_t value = corners[c], vertex = o->faces.corners[c];
        uint64_t slot;
        if (value == FLG_NO_INDEX || first[value] == vertex) continue;
        slot = ((uint64_t)value << 32 | vertex) * 0x9e3779b97f4a7c15ull;
        slot = (slot ^ slot >> 32) & (slots - 1);
        while (table[slot] != FLG_NO_INDEX && (copy_value[table[slot]] != value || copy_vertex[table[slot]] != vertex))
            slot = (slot + 1) & (slots - 1);
        if (table[slot] == FLG_NO_INDEX) {
            table[slot] = copies;
            copy_value[copies] = value;
            copy_vertex[copies++] = vertex;
        }
        corners[c] = count + table[slot];
    }
    *all = count + copies;
    *vertex_of = (uint32_t*)borrow(o, *all, sizeof(uint32_t));
    made = (float*)borrow(o, *all, 3 * sizeof(float));
    if (o->status != FLG_OK) return NULL;
    memcpy(made, values, 3 * (size_t)count * sizeof(float));
    for (uint32_t i = 0; i < count; ++i) (*vertex_of)[i] = first[i] == FLG_NO_INDEX ? 0 : first[i];
    for (uint32_t i = 0; i < copies; ++i) {
        memcpy(made + 3 * ((size_t)count + i), values + 3 * (size_t)copy_value[i], 3 * sizeof(float));
        (*vertex_of)[count + i] = copy_vertex[i];
    }
    return made;
}

/* The level's normals computed from its faces at rest. */
static FLG_COLD float* compute_normals(flg_opening* o) {
    const flg_model* model = o->model;
    const uint32_t vertices = model->info.vertices;
    const float* positions = o->positions;
    float* normals = (float*)borrow(o, vertices, 3 * sizeof(float));
    double* sums = (double*)borrow(o, vertices, 3 * sizeof(double));
    if (model->level_vertices) {
        float* own = (float*)borrow(o, vertices, 3 * sizeof(float));
        for (uint32_t v = 0; o->status == FLG_OK && v < vertices; ++v)
            memcpy(own + 3 * (size_t)v, o->positions + 3 * (size_t)model->level_vertices[v], 3 * sizeof(float));
        positions = own;
    }
    if (o->status != FLG_OK) return NULL;
    flg_vertex_normals(positions, vertices, &o->faces, sums, normals);
    return normals;
}

/* The sets of records, with the normals there are. */
static FLG_COLD void make_sets(flg_opening* o) {
    flg_model* model = o->model;
    flg_info* info = &model->info;
    uint64_t values = 0, corners = 0;
    float* normals = NULL;
    uint32_t* corner = NULL;
    if (!(o->flags & FLG_WITHOUT_NORMALS)) {
        normals = (float*)read_section(o, "nrm.val", 0, 12, &values);
        if (values > 0) corner = (uint32_t*)read_section(o, "nrm.cor", 0, 4, &corners);
        if (o->status != FLG_OK || !needs(o, values < FLG_NO_INDEX && all_finite(normals, 3 * values))) return;
        for (uint64_t i = 0; i < values; ++i) flg_unit(normals + 3 * i);
        if (values > 0 && corners == 0) {
            if (!needs(o, values == o->all_vertices)) return;
            for (uint32_t v = 0; model->level_vertices && v < info->vertices; ++v)
                memmove(normals + 3 * (size_t)v, normals + 3 * (size_t)model->level_vertices[v], 3 * sizeof(float));
            info->normal_source = FLG_NORMALS_VERTEX;
        } else if (values > 0 && !model->level_vertices) {
            uint32_t *vertex_of = NULL, all = 0;
            if (!needs(o, corners == o->corner_count && info->vertices > 0)) return;
            for (uint64_t c = 0; c < corners; ++c)
                if (!needs(o, corner[c] < values || corner[c] == FLG_NO_INDEX)) return;
            normals = split_normals(o, normals, (uint32_t)values, corner, &vertex_of, &all);
            make_set(o, &model->corner_normals, all, vertex_of, normals, 0);
            if (!(o->flags & FLG_WITHOUT_TRIANGLES))
                model->triangle_normals = make_fans(o, &o->faces, corner, info->triangles);
            info->normal_source = FLG_NORMALS_CORNER;
            info->normals = all;
        } else {
            normals = compute_normals(o);
            info->normal_source = FLG_NORMALS_COMPUTED;
        }
        if (info->normal_source != FLG_NORMALS_CORNER) info->normals = info->vertices;
    }
    make_set(o, &model->vertices, info->vertices, model->level_vertices,
             info->normal_source == FLG_NORMALS_CORNER ? NULL : normals, 1);
    info->parts =
        model->vertices.blocks > model->corner_normals.blocks ? model->vertices.blocks : model->corner_normals.blocks;
}

/* ---- Frames ---- */

/* Marks the frames that sections of one name are; their number, or DAMAGED where one is missing. */
static FLG_COLD uint32_t find_frames(flg_opening* o, const char* name, flg_frame* frames, uint32_t room) {
    char key[8];
    uint32_t count = 0, last = 0;
    const int gradients = name[5] == 'g';
    make_key(name, key);
    for (uint32_t k = 0; k < o->file.sections; ++k) {
        const flg_section section = section_at(&o->file, k);
        if (memcmp(section.name, key, 8) != 0) continue;
        if (!needs(o, section.index < room && section.item == (gradients ? 36u : 12u) &&
                          section.count == o->model->info.driver_vertices))
            return 0;
        if (gradients ? frames[section.index].has_gradients : frames[section.index].has_positions) continue;
        if (section.index > last) last = section.index;
        ++count;
        if (gradients) {
            frames[section.index].gradients = section.offset;
            frames[section.index].gradient_hash = section.hash;
            frames[section.index].has_gradients = 1;
        } else {
            frames[section.index].positions = section.offset;
            frames[section.index].position_hash = section.hash;
            frames[section.index].has_positions = 1;
        }
    }
    needs(o, count == 0 || last == count - 1);
    return count;
}

static FLG_COLD void find_decoded_frames(flg_opening* o) {
    flg_model* model = o->model;
    const flg_plain_section* at;
    for (at = model->decoded; at; at = at->next) model->info.frames += memcmp(at->name, "pose.pos", 8) == 0;
    model->frames = (flg_frame*)keep(o, model->info.frames, sizeof(flg_frame));
    if (!model->frames) return;
    memset(model->frames, 0, (size_t)model->info.frames * sizeof(flg_frame));
    for (at = model->decoded; at; at = at->next) {
        if (memcmp(at->name, "pose", 4) != 0) continue; /* frames count from 0 without a gap, as they are decoded */
        if (at->name[5] == 'p')
            model->frames[at->index].decoded_positions = at->items;
        else
            model->frames[at->index].decoded_gradients = at->items;
    }
    model->info.frames_have_gradients = model->info.frames > 0 && model->frames[0].decoded_gradients;
    if (model->info.frames == 0) return;
    read_value(o, "pose.fps", 8, &model->info.frames_per_second);
    needs(o, model->info.frames_per_second > 0 && model->info.frames_per_second <= DBL_MAX);
}

static FLG_COLD void read_frames(flg_opening* o) {
    flg_model* model = o->model;
    char key[8];
    uint32_t room = 0, gradients;
    if (o->file.is_packed) {
        find_decoded_frames(o);
        return;
    }
    make_key("pose.pos", key);
    for (uint32_t k = 0; k < o->file.sections; ++k) {
        const flg_section section = section_at(&o->file, k);
        room += memcmp(section.name, key, 8) == 0;
    }
    model->frames = (flg_frame*)keep(o, room, sizeof(flg_frame));
    if (!model->frames) return;
    memset(model->frames, 0, (size_t)room * sizeof(flg_frame));
    model->info.frames = find_frames(o, "pose.pos", model->frames, room);
    gradients = find_frames(o, "pose.grd", model->frames, room);
    if (!needs(o, gradients == 0 || gradients == model->info.frames)) return;
    model->info.frames_have_gradients = gradients > 0;
    if (model->info.frames == 0) return;
    read_value(o, "pose.fps", 8, &model->info.frames_per_second);
    needs(o, model->info.frames_per_second > 0 && model->info.frames_per_second <= DBL_MAX);
}

/* ---- All of it ---- */

static FLG_COLD void make_fit(flg_opening* o) {
    flg_model* model = o->model;
    flg_faces faces;
    void* scratch = borrow(o, 1, flg_fit_scratch_bytes(model->info.driver_vertices));
    if (!scratch) return;
    faces.corners = model->driver_triangles;
    faces.offsets = NULL;
    faces.count = model->info.driver_triangles;
    model->fit =
        flg_fit_begin(model->driver_rest, model->info.driver_vertices, &faces, model->kernel, &model->allocator);
    if (!model->fit) {
        fails(o, FLG_NO_MEMORY);
        return;
    }
    flg_fit_solve(model->fit, 0, model->info.driver_vertices, scratch);
    flg_fit_end(model->fit);
    model->info.has_fit = 1;
}

/* The level to open: its vertices and faces. */
static FLG_COLD void read_level(flg_opening* o, uint32_t level) {
    flg_model* model = o->model;
    const uint32_t finest = model->info.levels - 1;
    uint64_t triangles;
    model->info.level = level == FLG_FINEST ? finest : level;
    if (model->info.level > finest) {
        fails(o, FLG_MISSING);
        return;
    }
    if (model->info.level < finest) {
        const uint64_t count = section_count(o, "lev.vert", model->info.level, 4);
        if (!needs(o, count > 0 && count <= o->all_vertices)) return;
        model->info.vertices = (uint32_t)count;
        model->level_vertices = (uint32_t*)keep(o, count, 4);
        if (!model->level_vertices) return;
        copy_section(o, "lev.vert", model->info.level, model->level_vertices);
        for (uint64_t i = 0; i < count; ++i)
            if (!needs(o, model->level_vertices[i] < o->all_vertices &&
                              (i == 0 || model->level_vertices[i] > model->level_vertices[i - 1])))
                return;
    }
    read_faces(o, model->info.level < finest ? "lev" : "mesh", model->info.level < finest ? model->info.level : 0,
               model->info.vertices, &o->faces, &o->corner_count);
    if (o->status != FLG_OK) return;
    triangles = o->corner_count - 2 * (uint64_t)o->faces.count;
    model->info.faces = (uint32_t)o->faces.count;
    model->info.triangles = (uint32_t)triangles;
}

/* Keeps what a packed model's streams say beside faces, places and records. */
static FLG_COLD void keep_decoded(flg_opening* o) {
    static const char names[][5] = {"uv", "nrm", "col", "scal", "obj", "grp", "mat", "smoo", "pose"};
    for (const flg_plain_section* from = o->decoded; from; from = from->next) {
        int is_kept = 0;
        flg_plain_section* kept;
        for (size_t k = 0; k < sizeof names / sizeof names[0]; ++k)
            is_kept |= memcmp(from->name, names[k], strlen(names[k])) == 0;
        if (!is_kept) continue;
        kept = (flg_plain_section*)keep(o, 1, sizeof *kept);
        if (!kept) return;
        *kept = *from;
        kept->items = keep(o, from->count, from->item);
        if (!kept->items) return;
        memcpy(kept->items, from->items, (size_t)(from->count * from->item));
        kept->next = o->model->decoded;
        o->model->decoded = kept;
    }
}

static FLG_COLD const void* packed_section(void* user, const char* name, uint32_t index, uint32_t item,
                                           uint64_t* count) {
    flg_opening* o = (flg_opening*)user;
    flg_section section;
    const unsigned char* items;
    void* copy;
    *count = 0;
    if (!find_section(&o->file, name, index, &section) || section.item != item || !has_its_hash(&o->file, &section))
        return NULL;
    *count = section.count;
    items = o->file.bytes + section.offset;
    if (item == 1) return items;
    copy = borrow(o, section.count, item); /* aligned */
    if (copy) memcpy(copy, items, (size_t)(section.count * item));
    return copy;
}

static FLG_COLD void* packed_memory(void* user, uint64_t count, size_t item) {
    return borrow((flg_opening*)user, count, item);
}

static FLG_COLD void unpack(flg_opening* o) {
    flg_code_input input;
    flg_status status;
    input.user = o;
    input.section = packed_section;
    input.take = packed_memory;
    input.most_bytes = flg_most_unpacked(o->file.size);
    status = flg_read_code(&input, &o->decoded);
    if (status != FLG_OK) fails(o, status);
    keep_decoded(o);
}

static FLG_COLD void read_model(flg_opening* o, uint32_t level) {
    flg_model* model = o->model;
    uint32_t code = 0, records = 0, levels = 0, cells = 0;
    uint64_t vertices = 0;
    if (o->file.is_packed) unpack(o);
    read_value(o, "code", 4, &code);
    if (o->status == FLG_OK && code == 0) fails(o, FLG_UNSUITABLE);
    read_value(o, "levels", 4, &levels);
    read_value(o, "mesh.num", 8, &vertices);
    read_value(o, "mesh.org", 24, model->info.origin);
    read_value(o, "bl.prec", 4, &records);
    if (o->status == FLG_OK && records == 1) fails(o, FLG_OLD_RECORDS);
    if (!needs(o, code == 1 && levels > 0 && levels <= FLG_MOST_LEVELS && records == 0 && vertices < FLG_NO_INDEX))
        return;
    for (int k = 0; k < 3; ++k) needs(o, fabs(model->info.origin[k]) <= DBL_MAX);
    model->info.levels = levels + 1;
    o->all_vertices = (uint32_t)vertices;
    model->info.vertices = o->all_vertices;
    read_driver(o, &cells);
    read_level(o, level);
    read_order(o);
    read_runs(o, cells);
    read_weights(o);
    if (o->status != FLG_OK) return;
    choose_scale(o);
    make_triangles(o);
    make_sets(o);
    read_frames(o);
    if (o->status == FLG_OK && FLG_HAS_FIT && !(o->flags & FLG_WITHOUT_FIT)) make_fit(o);
}

static const uint32_t FLG_ALL_FLAGS =
    FLG_WITHOUT_CHECKSUMS | FLG_WITHOUT_NORMALS | FLG_WITHOUT_TRIANGLES | FLG_WITHOUT_FIT;

flg_status flg_open(const void* bytes, size_t size, const flg_options* options, flg_model** model) {
    flg_opening o;
    flg_allocator allocator = flg_default_allocator();
    const flg_kernel* kernel = flg_kernel_of(options && options->struct_size == sizeof *options ? options->lanes : 0);
    if (!model) return FLG_ARGUMENT;
    *model = NULL;
    if (!bytes || !kernel) return FLG_ARGUMENT;
    if (options && (options->struct_size != sizeof *options || (options->flags & ~FLG_ALL_FLAGS) != 0 ||
                    (options->allocate == NULL) != (options->release == NULL)))
        return FLG_ARGUMENT;
    if (options && options->allocate) {
        allocator.allocate = options->allocate;
        allocator.release = options->release;
        allocator.user = options->user;
    }
    memset(&o, 0, sizeof o);
    o.status = read_container(bytes, size, &o.file);
    if (o.status != FLG_OK) return o.status;
    o.flags = options ? options->flags : 0;
    o.file.checks_hashes = !(o.flags & FLG_WITHOUT_CHECKSUMS);
    o.model = (flg_model*)flg_allocate(&allocator, 1, sizeof(flg_model));
    if (!o.model) return FLG_NO_MEMORY;
    memset(o.model, 0, sizeof *o.model);
    o.model->allocator = allocator;
    o.model->kernel = kernel;
    o.model->file_size = size;
    o.model->table_hash = o.file.table_hash;
    o.model->checks_hashes = o.file.checks_hashes;
    o.model->info.lanes = (uint32_t)kernel->lanes;
    read_model(&o, options ? options->level : FLG_FINEST);
    release_pieces(&allocator, o.scratch);
    if (o.status != FLG_OK) {
        flg_close(o.model);
        return o.status;
    }
    *model = o.model;
    return FLG_OK;
}

void flg_close(flg_model* model) {
    flg_allocator allocator;
    if (!model) return;
    allocator = model->allocator;
    flg_fit_free(model->fit);
    release_pieces(&allocator, model->pieces);
    flg_release(&allocator, model);
}

/* ---- What a model has ---- */

flg_status flg_get_info(const flg_model* model, flg_info* info) {
    uint32_t size;
    if (!model || !info) return FLG_ARGUMENT;
    size = info->struct_size;
    if (size < sizeof size || size > sizeof *info) return FLG_ARGUMENT;
    memcpy(info, &model->info, size);
    info->struct_size = size;
    return FLG_OK;
}

const float* flg_driver_rest(const flg_model* model) { return model ? model->driver_rest : NULL; }
const uint32_t* flg_driver_triangles(const flg_model* model) {
    return model && model->info.driver_triangles > 0 ? model->driver_triangles : NULL;
}
const uint32_t* flg_triangles(const flg_model* model) {
    return model && model->info.triangles > 0 ? model->triangles : NULL;
}
const uint32_t* flg_triangle_uvs(const flg_model* model) { return model ? model->triangle_uvs : NULL; }
const uint32_t* flg_triangle_normals(const flg_model* model) { return model ? model->triangle_normals : NULL; }
const uint32_t* flg_triangle_faces(const flg_model* model) { return model ? model->triangle_faces : NULL; }
const uint32_t* flg_level_vertices(const flg_model* model) { return model ? model->level_vertices : NULL; }

flg_status flg_find_decoded(const flg_model* model, const char* name, uint32_t index, const void** items,
                            uint32_t* item_size, size_t* count) {
    const flg_plain_section* found;
    if (!model || !name || !items || !item_size || !count || strlen(name) > 8) return FLG_ARGUMENT;
    found = find_decoded(model->decoded, name, index);
    *items = found ? found->items : NULL;
    *item_size = found ? found->item : 0;
    *count = found ? (size_t)found->count : 0;
    return found ? FLG_OK : FLG_MISSING;
}

/* A section of the file that was opened, `count` items of so many bytes; NULL: it is damaged. */
static const unsigned char* opened_section(const flg_model* model, const unsigned char* bytes, uint64_t offset,
                                           uint64_t hash, size_t item) {
    const unsigned char* section = bytes + offset; /* within file_size, as the table was checked */
    const size_t size = item * model->info.driver_vertices;
    return !model->checks_hashes || hash_of(section, size) == hash ? section : NULL;
}

/* Column by column; files have row after row. */
static void copy_gradients(const void* from, size_t count, float* gradients) {
    for (size_t v = 0; v < count; ++v) {
        float rows[9];
        memcpy(rows, (const unsigned char*)from + 36 * v, sizeof rows);
        for (size_t k = 0; k < 9; ++k) gradients[9 * v + k] = rows[k % 3 * 3 + k / 3];
    }
}

flg_status flg_read_frame(const flg_model* model, const void* bytes, size_t size, uint32_t frame, float* positions,
                          float* gradients) {
    uint64_t table_hash;
    const flg_frame* found;
    const unsigned char *at, *all = (const unsigned char*)bytes;
    if (!model || !bytes || !positions) return FLG_ARGUMENT;
    if (size != model->file_size || size < FLG_HEADER) return FLG_MISMATCH;
    memcpy(&table_hash, all + 24, sizeof table_hash);
    if (table_hash != model->table_hash) return FLG_MISMATCH;
    if (frame >= model->info.frames || (gradients && !model->info.frames_have_gradients)) return FLG_MISSING;
    found = model->frames + frame;
    if (found->decoded_positions) {
        memcpy(positions, found->decoded_positions, 12 * (size_t)model->info.driver_vertices);
        if (gradients) copy_gradients(found->decoded_gradients, model->info.driver_vertices, gradients);
        return FLG_OK;
    }
    at = opened_section(model, all, found->positions, found->position_hash, 12);
    if (!at) return FLG_DAMAGED;
    memcpy(positions, at, 12 * (size_t)model->info.driver_vertices);
    if (!all_finite(positions, 3 * (uint64_t)model->info.driver_vertices)) return FLG_DAMAGED;
    if (!gradients) return FLG_OK;
    at = opened_section(model, all, found->gradients, found->gradient_hash, 36);
    if (!at) return FLG_DAMAGED;
    copy_gradients(at, model->info.driver_vertices, gradients);
    return all_finite(gradients, 9 * (uint64_t)model->info.driver_vertices) ? FLG_OK : FLG_DAMAGED;
}

flg_status flg_gradients(const flg_model* model, const float* positions, uint32_t driver_vertices, uint32_t first,
                         uint32_t count, float* gradients) {
    if (!model || !positions || !gradients) return FLG_ARGUMENT;
    if (driver_vertices != model->info.driver_vertices) return FLG_MISMATCH;
    if (first > driver_vertices || count > driver_vertices - first) return FLG_ARGUMENT;
    if (!model->fit) return FLG_MISSING;
    flg_fit_gradients(model->fit, positions, first, first + count, gradients);
    return FLG_OK;
}

/* ---- Restoring ---- */

/* In a pose: what it was made for, and from the next multiple of 64 bytes on the transforms. Where gradients are
 * estimated, they lie behind the transforms. */
typedef struct flg_pose {
    const flg_model* model;
    flg_scales scales;
} flg_pose;

/* The transforms of a pose: aligned by their address, so a pose must stay where it is. */
static flg_transform* transforms_in(void* pose) {
    const uintptr_t end = (uintptr_t)pose + sizeof(flg_pose);
    return (flg_transform*)((end + FLG_ALIGNMENT - 1) / FLG_ALIGNMENT * FLG_ALIGNMENT);
}

size_t flg_pose_bytes(const flg_model* model) {
    uint64_t bytes;
    if (!model) return 0;
    bytes = sizeof(flg_pose) + FLG_ALIGNMENT + (uint64_t)model->info.driver_vertices * sizeof(flg_transform) +
            (model->fit ? (uint64_t)model->info.driver_vertices * 9 * sizeof(float) : 0);
    return bytes < SIZE_MAX ? (size_t)bytes : SIZE_MAX;
}

flg_status flg_set_pose(const flg_model* model, const float* positions, const float* gradients,
                        uint32_t driver_vertices, void* pose) {
    flg_pose* made = (flg_pose*)pose;
    flg_transform* transforms;
    if (!model || !positions || !pose) return FLG_ARGUMENT;
    if (driver_vertices != model->info.driver_vertices) return FLG_MISMATCH;
    if (!gradients && !model->fit) return FLG_MISSING;
    transforms = transforms_in(pose);
    if (!gradients) {
        float* estimated = (float*)(transforms + driver_vertices);
        flg_fit_gradients(model->fit, positions, 0, driver_vertices, estimated);
        gradients = estimated;
    }
    flg_make_transforms(model->inner_rest, model->inner_scale, positions, gradients, 0, driver_vertices, transforms);
    made->model = model;
    made->scales.position = (float)(1 / model->inner_scale);
    made->scales.normal = flg_normal_scale(transforms, driver_vertices);
    return FLG_OK;
}

size_t flg_scratch_bytes(const flg_model* model) {
    return model ? FLG_SCRATCH_FLOATS * sizeof(float) + FLG_ALIGNMENT : 0;
}

FLG_APART void restore_block_of(const flg_model* model, const flg_record_set* set, uint32_t block,
                                const flg_transform* transforms, flg_scales scales, flg_slots positions,
                                flg_slots normals, float* scratch) {
    const size_t first = (size_t)block * FLG_BLOCK, left = set->slots - first;
    if (positions.points) positions.points += first * positions.stride;
    if (normals.points) normals.points += first * normals.stride;
    flg_restore_block(model->kernel, &set->records, transforms, scales, set->block_runs[block],
                      set->block_runs[block + 1], set->from + first, left < FLG_BLOCK ? left : (size_t)FLG_BLOCK,
                      positions, normals, 0, scratch);
}

FLG_APART flg_status restore_parts(const flg_model* model, const void* pose, uint32_t first_part, uint32_t part_count,
                                   float* positions, size_t position_stride, float* normals, size_t normal_stride,
                                   void* scratch) {
    const flg_pose* set = (const flg_pose*)pose;
    const flg_transform* transforms;
    float* aligned;
    flg_slots to, normals_to, nowhere;
    if (!model || !pose || !scratch || set->model != model) return FLG_ARGUMENT;
    if (first_part > model->info.parts || part_count > model->info.parts - first_part) return FLG_ARGUMENT;
    if ((positions && (position_stride < 12 || position_stride % 4 != 0)) ||
        (normals && (normal_stride < 12 || normal_stride % 4 != 0)))
        return FLG_ARGUMENT;
    if (normals && model->info.normals == 0 && model->info.vertices > 0) return FLG_MISSING;
    transforms = transforms_in((void*)(uintptr_t)pose);
    aligned = (float*)(((uintptr_t)scratch + FLG_ALIGNMENT - 1) / FLG_ALIGNMENT * FLG_ALIGNMENT);
    to.points = positions;
    to.stride = position_stride / sizeof(float);
    normals_to.points = normals;
    normals_to.stride = normal_stride / sizeof(float);
    nowhere.points = NULL;
    nowhere.stride = 0;
    for (uint32_t part = first_part; part < first_part + part_count; ++part) {
        const int with_normals = normals && model->vertices.has_normals;
        if (part < model->vertices.blocks && (positions || with_normals))
            restore_block_of(model, &model->vertices, part, transforms, set->scales, to,
                             with_normals ? normals_to : nowhere, aligned);
        if (part < model->corner_normals.blocks && normals)
            restore_block_of(model, &model->corner_normals, part, transforms, set->scales, nowhere, normals_to,
                             aligned);
    }
    return FLG_OK;
}

flg_status flg_restore_parts(const flg_model* model, const void* pose, uint32_t first_part, uint32_t part_count,
                             float* positions, size_t position_stride, float* normals, size_t normal_stride,
                             void* scratch) {
    return restore_parts(model, pose, first_part, part_count, positions, position_stride, normals, normal_stride,
                         scratch);
}

flg_status flg_restore(const flg_model* model, const void* pose, float* positions, float* normals, void* scratch) {
    if (!model) return FLG_ARGUMENT;
    return restore_parts(model, pose, 0, model->info.parts, positions, 12, normals, 12, scratch);
}

static void part_of(const flg_record_set* set, uint32_t part, uint32_t* first, uint32_t* count) {
    const uint64_t begin = (uint64_t)part * FLG_BLOCK;
    const uint64_t at = begin < set->slots ? begin : set->slots, left = set->slots - at;
    if (first) *first = (uint32_t)at;
    if (count) *count = (uint32_t)(left < FLG_BLOCK ? left : (uint64_t)FLG_BLOCK);
}

flg_status flg_get_part(const flg_model* model, uint32_t part, uint32_t* first_vertex, uint32_t* vertices,
                        uint32_t* first_normal, uint32_t* normals) {
    if (!model || part >= model->info.parts) return FLG_ARGUMENT;
    part_of(&model->vertices, part, first_vertex, vertices);
    if (model->info.normal_source == FLG_NORMALS_CORNER) {
        part_of(&model->corner_normals, part, first_normal, normals);
    } else {
        part_of(&model->vertices, part, first_normal, normals);
        if (normals && model->info.normals == 0) *normals = 0;
    }
    return FLG_OK;
}

/* ---- For graphics cards ---- */

/* The last of runs begin to end - 1 that begins at a record or before it. */
static const flg_run* run_of(const flg_run* runs, uint32_t begin, uint32_t end, uint32_t record) {
    while (end - begin > 1) {
        const uint32_t middle = begin + (end - begin) / 2;
        if (runs[middle].first <= record)
            begin = middle;
        else
            end = middle;
    }
    return runs + begin;
}

FLG_COLD flg_status flg_skin(const flg_model* model, uint32_t first, uint32_t count, uint32_t* drivers, float* weights,
                             float* points) {
    const flg_record_set* set;
    const flg_records* records;
    if (!model || !drivers || !weights || !points) return FLG_ARGUMENT;
    if (first > model->info.vertices || count > model->info.vertices - first) return FLG_ARGUMENT;
    set = &model->vertices;
    records = &set->records;
    for (uint32_t v = first; v < first + count; ++v, drivers += 3, weights += 3, points += 3) {
        const uint32_t *runs = set->block_runs + v / FLG_BLOCK,
                       record = records->runs[runs[0]].first + (uint32_t)set->from[v];
        const uint32_t cell = run_of(records->runs, runs[0], runs[1], record)->cell;
        const float u = records->u[record], w = records->v[record];
        memcpy(drivers, records->cells + 3 * (size_t)cell, 3 * sizeof *drivers);
        weights[0] = 1 - u - w;
        weights[1] = u;
        weights[2] = w;
        for (size_t k = 0; k < 3; ++k) points[k] = (float)((double)records->q[k][record] / model->inner_scale);
    }
    return FLG_OK;
}

FLG_COLD flg_status flg_skin_matrices(const flg_model* model, const void* pose, float* matrices) {
    const flg_pose* set = (const flg_pose*)pose;
    const flg_transform* transforms;
    if (!model || !pose || !matrices || set->model != model) return FLG_ARGUMENT;
    transforms = transforms_in((void*)(uintptr_t)pose);
    for (size_t i = 0; i < model->info.driver_vertices; ++i, matrices += 16)
        for (size_t column = 0; column < 4; ++column) {
            const float* from = column < 3 ? transforms[i].a + 3 * column : transforms[i].t;
            for (size_t k = 0; k < 3; ++k)
                matrices[4 * column + k] = column < 3 ? from[k] : from[k] * set->scales.position;
            matrices[4 * column + 3] = column < 3 ? 0.0f : 1.0f;
        }
    return FLG_OK;
}
