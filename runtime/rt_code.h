/* Packed models of the profile `runtime`: mesh and records as symbols. The runtime and libfiligree read with this code,
 * and libfiligree writes with it (FLG_WITH_WRITER), so that both sides expect the same. Not part of the interface.
 * docs/packing.md explains the code, docs/fil-format.md the sections. */
#ifndef FILIGREE_RT_CODE_H
#define FILIGREE_RT_CODE_H

#include "filigree_rt.h"
#include "rt_base.h"

#ifdef __cplusplus
extern "C" {
#endif

enum {
    FLG_CODE_REVISION = 1,
    FLG_CODE_DRIVER_BEHIND = 1, /* for flg_code_sizes.flags: the last vertices are the driver's own */
    FLG_CODE_OTHER_CELLS = 2,   /* cells are not the driver's faces */
    FLG_CODE_ALPHA = 4,         /* colours came with alpha */
    FLG_WEIGHT_BITS = 10
};

/* The section "rt.par". */
typedef struct flg_code_sizes {
    uint32_t revision, flags;
    uint64_t vertices, faces, corners; /* vertices: with those of a driver behind the mesh's own */
    uint32_t face_size;                /* corners of every face; 0: they differ */
    uint32_t driver_vertices, driver_faces, cells;
    uint32_t bits, weight_bits; /* positions along the longest side; a step of a weight is 2^-weight_bits */
    double low[3], step;        /* position k is low + step * place, relative to the origin */
} flg_code_sizes;

/* The section "rt.att": values of vertices, corners or faces. */
enum {
    FLG_VALUES_OF_VERTICES = 0, /* columns of low + step * integer */
    FLG_VALUES_OF_CORNERS = 1,  /* the same, and which one each corner has */
    FLG_WORDS_OF_VERTICES = 2,  /* 32 bits, as they are */
    FLG_NUMBERS_OF_FACES = 3,
    FLG_NORMALS_OF_VERTICES = 4, /* two columns: a place on an octahedron */
    FLG_NORMALS_OF_CORNERS = 5
};
typedef struct flg_code_values {
    char name[8];                         /* of the plain section */
    uint32_t index, kind, columns, count; /* count: items */
    double low[4], step[4];
} flg_code_values;

/* A section of the plain model file. Sections in chunks lie one behind another, but for "bl.run". */
typedef struct flg_plain_section {
    struct flg_plain_section* next;
    char name[8];
    uint32_t index, item;
    uint64_t count;
    void* items;
} flg_plain_section;

/* Where sections of the packed file and memory come from. */
typedef struct flg_code_input {
    void* user;
    /* The items of a section, aligned as their numbers are, with their checksum compared; NULL: there is none, or it is
     * damaged. */
    const void* (*section)(void* user, const char* name, uint32_t index, uint32_t item, uint64_t* count);
    void* (*take)(void* user, uint64_t count, size_t item); /* memory; NULL: there is none */
    double most_bytes;                                      /* that the model may come to */
} flg_code_input;

/* The plain sections that a packed file's streams stand for, without names, pictures and what else is in it as it is.
 * Errors: DAMAGED, NEWER, NO_MEMORY. */
FLG_SHARED flg_status flg_read_code(const flg_code_input* input, flg_plain_section** sections);

/* The most bytes that a file of so many may come to: small ones might ask for any memory. */
FLG_INLINE double flg_most_unpacked(uint64_t file_bytes) {
    const double always = 268435456.0, times = 1024.0 * (double)file_bytes;
    return times > always ? times : always;
}

/* The memory that a model of these sizes takes while it is read. */
FLG_INLINE double flg_code_bytes(const flg_code_sizes* s) {
    return 78.0 * (double)s->vertices + 4.0 * ((double)s->corners + (double)s->faces) + 400.0 * (double)s->cells +
           64.0 * (double)s->driver_vertices;
}

/* Writing, in libfiligree alone (FLG_WITH_WRITER): what is written. Vertices, faces and corners are the source's. */
typedef struct flg_code_source {
    void* user;
    void (*symbol)(void* user, uint32_t context, uint32_t symbol);
    void (*number)(void* user, uint32_t context, uint32_t value);
    void (*bits)(void* user, uint32_t value, uint32_t count);
    /* The face that has an edge and was not asked for yet, 0xffffffff: none; *corner: that of `from`. from 0xffffffff:
     * any face. of_driver: of the driver's faces. */
    uint32_t (*face_at)(void* user, int of_driver, uint32_t from, uint32_t to, uint32_t* corner);
    flg_faces mesh, driver;    /* the driver's corners are its own numbers */
    const int32_t* places;     /* 3 a vertex */
    const uint32_t* driver_of; /* of each vertex: which of the driver's it is, or 0xffffffff */
    const uint32_t* vertex_of; /* of each of the driver's vertices */
    const float* driver_rest;  /* FLG_CODE_DRIVER_BEHIND: 3 floats each */
    const uint32_t* cells;     /* 3 driver vertices each */
    const uint32_t* cell;      /* of each vertex */
    const float *u, *v;        /* of each vertex */
    double anchor_tolerance;   /* how far a vertex's anchor may move: then the expected weights are taken */
    /* Written: the number of each vertex, and what a reader gets in the order in which it gets it. */
    uint32_t *number_of, *face_order, *corner_order; /* the source's face and corner that each is */
    uint32_t *read_corners, *read_offsets;           /* read_offsets: where faces differ in size */
    double* moved;                                   /* of each vertex: how far its anchor moves */
} flg_code_source;
enum { FLG_MESH_CONTEXTS = 112, FLG_VALUE_CONTEXTS = 64 };

/* The point of a triangle that is closest to a point. */
FLG_SHARED void flg_closest_anchor(const float* corner0, const float* corner1, const float* corner2, const float* point,
                                   float* anchor);
/* Writes a model's mesh, driver and records: the section "rt.mesh". */
FLG_SHARED flg_status flg_write_code(const flg_code_sizes* sizes, const flg_code_source* source,
                                     const flg_code_input* memory);
/* Writes values, a section "rt.val". faces: of the mesh as it is read (offsets NULL where they have one size). items:
 * `columns` integers each, of vertices and faces in the order in which they are read. item_of: of each corner; for
 * kinds of corners alone; each item is used. */
FLG_SHARED flg_status flg_write_values(const flg_code_sizes* sizes, const flg_code_values* values,
                                       const flg_code_source* source, const flg_faces* faces, const int32_t* items,
                                       const uint32_t* item_of, const flg_code_input* memory);

#ifdef __cplusplus
}
#endif
#endif
