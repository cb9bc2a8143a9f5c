/* filigree_rt: puts detail back onto a moved driver, in C11 without dependencies.
 *
 * A model is a detailed mesh whose vertices are bound to a light one, the driver. Your program moves the driver's
 * vertices: a simulator, a cage, an animation. The runtime restores the mesh.
 *
 *     flg_model* model;
 *     if (flg_open(bytes, size, NULL, &model) != FLG_OK) ...            once
 *     void* pose = malloc(flg_pose_bytes(model));
 *     void* scratch = malloc(flg_scratch_bytes(model));
 *     flg_set_pose(model, driver_positions, NULL, driver_vertices, pose);   each frame
 *     flg_restore(model, pose, positions, normals, scratch);
 *
 * `filigree strip scan.ply -o scan.fil` writes models. docs/runtime.md has sizes, speeds and limits.
 *
 * Bytes: the same input gives the same output bytes on every processor, compiler and vector width.
 * Threads: a model does not change after it was opened. Any number of threads may use it at the same time, each with a
 * pose and scratch memory of its own; threads that restore parts of one pose share the pose.
 * Memory: only flg_open and flg_close call the allocator. Nothing is kept in globals.
 * Positions are in the model's units, relative to flg_info.origin. Arrays are packed: 3 floats a point.
 * Pointers must be aligned as their type is, except `bytes`. NULL for an argument that needs a value gives
 * FLG_ARGUMENT. Not a number in a pose goes through into the vertices that use it. */
#ifndef FILIGREE_RT_H
#define FILIGREE_RT_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* The version of this interface. Within a version, functions and fields are only added. */
#define FLG_ABI 1u

/* What a function came to. Numbers never change their meaning. */
typedef enum flg_status {
    FLG_OK = 0,
    FLG_NO_MEMORY = 1,   /* the allocator returned NULL, or the model needs more than this machine can address */
    FLG_NOT_A_MODEL = 2, /* the bytes do not begin as a model does */
    FLG_DAMAGED = 3,     /* cut off, a wrong checksum, or numbers that contradict each other */
    FLG_NEWER = 4,       /* written by a later program: use a later runtime */
    FLG_UNSUITABLE = 5,  /* packed by another profile, with the reference code, or of a program before 0.1.0 */
    FLG_ARGUMENT = 6,    /* NULL, or a number that is out of its range */
    FLG_MISMATCH = 7,    /* another number of driver vertices than the model's */
    FLG_MISSING = 8,     /* the model has no such level, section, frame, normals or gradient fit */
    FLG_OLD_RECORDS = 9  /* the model has int16 records, of a program before 0.1.0: strip the mesh again */
} flg_status;

/* One sentence in English. Never NULL; lives as long as the program. */
const char* flg_status_text(flg_status status);

/* FLG_ABI of the runtime that is linked. */
uint32_t flg_abi(void);

/* An opened model. */
typedef struct flg_model flg_model;

/* For flg_options.flags. */
#define FLG_WITHOUT_CHECKSUMS 1u /* do not hash the sections: opens sooner, damage may stay unseen */
#define FLG_WITHOUT_NORMALS 2u
#define FLG_WITHOUT_TRIANGLES 4u /* no index arrays of the mesh; the driver's are kept */
#define FLG_WITHOUT_FIT 8u       /* no gradient fit: every pose needs gradients */

#define FLG_FINEST 0xffffffffu

typedef struct flg_options {
    uint32_t struct_size; /* sizeof(flg_options) */
    uint32_t flags;       /* 0, or a sum of those above */
    uint32_t level;       /* 0 (the driver) to flg_info.levels - 1, or FLG_FINEST */
    uint32_t lanes;       /* vertices at a time: 0 the most this processor has; else one of 1, 4, 8, 16 that is there */
    /* Both or neither (malloc and free). allocate: memory for any type, or NULL. */
    void* (*allocate)(void* user, size_t bytes);
    void (*release)(void* user, void* memory);
    void* user;
} flg_options;

/* Opens a model file, version 2, that lies in memory: plain, or packed with the profile `runtime`. `bytes` are copied,
 * and may go afterwards.
 * options: NULL means { sizeof(flg_options), 0, FLG_FINEST, 0, NULL, NULL, NULL }.
 * *model: the model, or NULL after an error.
 * Cost: O(size), and one system of 36 equations for each driver vertex. Memory: about 34 bytes a vertex, 12 more with
 * normals, 12 for each triangle, 1.3 KB for each driver vertex.
 * Errors: NOT_A_MODEL, DAMAGED, NEWER, UNSUITABLE, OLD_RECORDS, MISSING (no such level), ARGUMENT, NO_MEMORY. */
flg_status flg_open(const void* bytes, size_t size, const flg_options* options, flg_model** model);

/* Gives the model's memory back. NULL is allowed. */
void flg_close(flg_model* model);

/* Where a model's normals come from. */
#define FLG_NORMALS_NONE 0u     /* opened without */
#define FLG_NORMALS_VERTEX 1u   /* the file's, one a vertex */
#define FLG_NORMALS_CORNER 2u   /* the file's, chosen by the corners of faces: flg_triangle_normals */
#define FLG_NORMALS_COMPUTED 3u /* the file has none: of the faces at rest, weighted by area; one a vertex */

typedef struct flg_info {
    uint32_t struct_size;   /* sizeof(flg_info), set by the caller */
    uint32_t vertices;      /* positions that a restore writes */
    uint32_t normals;       /* normals that a restore writes; 0 without */
    uint32_t normal_source; /* FLG_NORMALS_... */
    uint32_t triangles;     /* of the level that was opened, faces as fans */
    uint32_t faces;
    uint32_t driver_vertices;
    uint32_t driver_triangles;      /* 0: the driver is points */
    uint32_t levels;                /* in the file, the finest included */
    uint32_t level;                 /* the one that was opened */
    uint32_t parts;                 /* flg_restore_parts */
    uint32_t frames;                /* poses in the file */
    uint32_t frames_have_gradients; /* 0 or 1 */
    uint32_t has_fit;               /* 0 or 1 */
    uint32_t lanes;                 /* vertices at a time */
    double frames_per_second;       /* 0 without frames */
    double origin[3];               /* to be added to all positions */
} flg_info;

/* Fills the first info->struct_size bytes. Errors: ARGUMENT (struct_size is not set, or larger than this runtime's). */
flg_status flg_get_info(const flg_model* model, flg_info* info);

/* Arrays of the model. They live as long as it does. NULL: the model has none, or was opened without. */
const float* flg_driver_rest(const flg_model* model);         /* 3 floats a driver vertex, at rest */
const uint32_t* flg_driver_triangles(const flg_model* model); /* 3 driver vertices a triangle */
const uint32_t* flg_triangles(const flg_model* model);        /* 3 vertices a triangle */
/* 3 a triangle, numbers of UVs: items of section "uv.val". Where the file has one UV a vertex, and at a level below
 * the finest, NULL: the numbers are those of the vertices (of the finest level: flg_level_vertices). */
const uint32_t* flg_triangle_uvs(const flg_model* model);
/* 3 a triangle, of the normals that a restore writes; 0xffffffff for a corner without. NULL: those of the vertices. */
const uint32_t* flg_triangle_normals(const flg_model* model);
/* The face of each triangle, for sections that have an item a face ("mat.fac"). NULL: they are the same. */
const uint32_t* flg_triangle_faces(const flg_model* model);
/* The vertex of the finest level of each vertex of this one, ascending. NULL at the finest level. */
const uint32_t* flg_level_vertices(const flg_model* model);

/* Finds UVs ("uv.val"), normals, colours, further numbers, and objects, groups, materials or smoothing groups of faces
 * ("mat.fac") of a model that is packed with the profile `runtime`, as the sections that the plain file would have
 * (docs/fil-format.md). Names, materials and pictures are in the file: flg_find_section. The items live as long as the
 * model. Errors: MISSING (also of a plain model: use flg_find_section), ARGUMENT. */
flg_status flg_find_decoded(const flg_model* model, const char* name, uint32_t index, const void** items,
                            uint32_t* item_size, size_t* count);

/* Finds a section of a plain model file: its UVs, colours, materials, names and pictures (docs/fil-format.md lists
 * them). bytes, size: the file, not needed to be open. name: at most 8 characters. index: most have 0.
 * *items: the first item inside `bytes`, aligned to 8 where `bytes` is. *count: number of items, of *item_size bytes.
 * The section's checksum is compared. Cost: O(sections + bytes of the section).
 * Errors: MISSING, NOT_A_MODEL, DAMAGED, NEWER, UNSUITABLE, ARGUMENT, NO_MEMORY (longer than a size_t). */
flg_status flg_find_section(const void* bytes, size_t size, const char* name, uint32_t index, const void** items,
                            uint32_t* item_size, size_t* count);

/* Reads a pose of the file that was opened. bytes, size: that file. frame: from 0 to flg_info.frames - 1.
 * positions: 3 floats a driver vertex. gradients: 9 floats a driver vertex, column by column, or NULL: not wanted.
 * Errors: MISSING (no such frame, or gradients are wanted and the file has none), DAMAGED, MISMATCH (other bytes than
 * those that were opened), ARGUMENT. After an error the arrays may be partly written. */
flg_status flg_read_frame(const flg_model* model, const void* bytes, size_t size, uint32_t frame, float* positions,
                          float* gradients);

/* Estimates how space is deformed around each driver vertex from the positions of its neighbours: the gradient of the
 * triharmonic interpolant (docs/blend-code.md). Exact for affine motions.
 * positions: 3 floats a driver vertex. gradients: 9 a driver vertex, written column by column: a column says where a
 * unit step along x, y or z at rest leads. May be called for a range of vertices, from several threads.
 * Cost: 32 multiplications of a vector with a vector for each vertex. Errors: MISMATCH, MISSING (opened WITHOUT_FIT),
 * ARGUMENT (first + count is more than driver_vertices). */
flg_status flg_gradients(const flg_model* model, const float* positions, uint32_t driver_vertices, uint32_t first,
                         uint32_t count, float* gradients);

/* Bytes of a pose that flg_set_pose fills: 64 for each driver vertex, and some. 0 for NULL. */
size_t flg_pose_bytes(const flg_model* model);

/* Prepares a pose of the driver.
 * positions: 3 floats a driver vertex. gradients: 9 floats a driver vertex, column by column, or NULL: estimated by the
 * fit. driver_vertices: how many the arrays have, to be compared with the model's. pose: flg_pose_bytes bytes of the
 * caller's, aligned as malloc's are, that stay where they are; later poses may overwrite them.
 * Cost: O(driver vertices). Errors: MISMATCH, MISSING (no gradients are given, and opened WITHOUT_FIT), ARGUMENT. */
flg_status flg_set_pose(const flg_model* model, const float* positions, const float* gradients,
                        uint32_t driver_vertices, void* pose);

/* Bytes of scratch memory for a restore, the same for each thread: about 1 MB. 0 for NULL. */
size_t flg_scratch_bytes(const flg_model* model);

/* Restores the mesh in a pose.
 * positions: 3 floats a vertex, or NULL: not wanted. normals: 3 floats a normal, of length 1 (or 0 where the rest
 * normal is 0), or NULL. scratch: flg_scratch_bytes bytes of the caller's, aligned as malloc's are; any content.
 * Cost: about 2 ns a vertex, 4 with normals. Errors: MISSING (normals are wanted and there are none), ARGUMENT. */
flg_status flg_restore(const flg_model* model, const void* pose, float* positions, float* normals, void* scratch);

/* Restores parts of the mesh, for several threads. The parts together write what flg_restore writes.
 * first_part, part_count: within flg_info.parts. Positions and normals point to those of vertex 0 and normal 0, and
 * have room for all. position_stride, normal_stride: bytes from a point to the next, 12 or more and a multiple of 4.
 * Errors: as flg_restore. */
flg_status flg_restore_parts(const flg_model* model, const void* pose, uint32_t first_part, uint32_t part_count,
                             float* positions, size_t position_stride, float* normals, size_t normal_stride,
                             void* scratch);

/* What a part writes: vertices first_vertex to first_vertex + vertices - 1, and normals likewise. Pointers may be NULL.
 * Errors: ARGUMENT (no such part). */
flg_status flg_get_part(const flg_model* model, uint32_t part, uint32_t* first_vertex, uint32_t* vertices,
                        uint32_t* first_normal, uint32_t* normals);

/* ---- For graphics cards ----
 * A restore is a linear skin, so a vertex shader can do it: vertex v goes to
 *     sum over k = 0, 1, 2 of weights[3 v + k] * (matrix of drivers[3 v + k]) * (points of v, 1)
 * Normals turn with the cofactor of the sum of the matrices, from those of a restore at rest. A card rounds otherwise,
 * so it does not give the same bytes. */

/* The skin of vertices first to first + count - 1. drivers: 3 driver vertices each, which may be the same. weights: 3
 * each, with the sum 1. points: 3 floats each; these are not rest positions. Items are written from the first on.
 * Cost: O(count log count). Errors: ARGUMENT (first + count is more than flg_info.vertices). */
flg_status flg_skin(const flg_model* model, uint32_t first, uint32_t count, uint32_t* drivers, float* weights,
                    float* points);

/* A pose as matrices: 16 floats a driver vertex, column by column, the last row 0 0 0 1.
 * Errors: ARGUMENT (NULL, or a pose of another model). */
flg_status flg_skin_matrices(const flg_model* model, const void* pose, float* matrices);

#ifdef __cplusplus
}
#endif
#endif
