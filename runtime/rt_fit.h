/* Gradients of a driver from its positions alone, as the runtime and libfiligree use it. Not part of the interface. */
#ifndef FILIGREE_RT_FIT_H
#define FILIGREE_RT_FIT_H

#include "rt_base.h"
#include "rt_kernel.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct flg_fit flg_fit;

/* Begins a fit: finds what is connected and sorts the vertices by place. rest: 3 floats a vertex, finite, copied.
 * NULL: there is no memory. Then, for all vertices, flg_fit_solve; then flg_fit_end. */
FLG_SHARED flg_fit* flg_fit_begin(const float* rest, uint32_t count, const flg_faces* faces, const flg_kernel* kernel,
                                  const flg_allocator* allocator);
/* Finds the neighbours of vertices begin to end - 1 and solves for their weights. Ranges may be solved on several
 * threads, each with scratch memory of its own: flg_fit_scratch_bytes bytes. */
FLG_SHARED size_t flg_fit_scratch_bytes(uint32_t count);
FLG_SHARED void flg_fit_solve(flg_fit* fit, uint32_t begin, uint32_t end, void* scratch);
FLG_SHARED void flg_fit_end(flg_fit* fit);
FLG_SHARED void flg_fit_free(flg_fit* fit);

/* The gradients of vertices begin to end - 1, 9 floats each, column by column. */
FLG_SHARED void flg_fit_gradients(const flg_fit* fit, const float* positions, uint32_t begin, uint32_t end,
                                  float* gradients);

#ifdef FLG_WITH_FIT_TERMS /* libfiligree alone, which hands them out as matrices */
enum { FLG_MOST_FIT_TERMS = 32 };
/* A vertex's gradient before what is flat is completed: constant + the sum of (c_j' - c_i') weights[j]^T. */
typedef struct flg_fit_terms {
    double weights[FLG_MOST_FIT_TERMS][3];
    uint32_t vertices[FLG_MOST_FIT_TERMS];
    uint32_t count;
    float constant[9];            /* column by column */
    float line[3], normal[3];     /* directions in which the neighbours spread most, and least */
    float beside_line, off_plane; /* share of what is completed across `line`, and along `normal`: 0 to 1 */
} flg_fit_terms;
FLG_SHARED void flg_fit_terms_of(const flg_fit* fit, uint32_t vertex, flg_fit_terms* terms);
#endif

#ifdef __cplusplus
}
#endif
#endif
