/* The inner loops for FLG_N vertices at a time. rt_kernel.c includes this once for each width, with FLG_N and
 * FLG_TARGET set. Every width does the same operations in the same order, so that all give the same bytes. */
#define FLG_JOIN2(a, b) a##b
#define FLG_JOIN(a, b) FLG_JOIN2(a, b)
#define FLG_NAME(name) FLG_JOIN(name, FLG_N)

#define FLG_HERE FLG_TARGET FLG_INLINE

#if FLG_N > 1
typedef float FLG_NAME(lanes_) __attribute__((vector_size(4 * FLG_N)));
typedef float FLG_NAME(loose_) __attribute__((vector_size(4 * FLG_N), aligned(4), may_alias));
typedef int32_t FLG_NAME(ints_) __attribute__((vector_size(4 * FLG_N)));
#else
typedef float FLG_NAME(lanes_);
#endif
#define FLG_VEC FLG_NAME(lanes_)

#if FLG_N > 1
#define FLG_LOAD(p) ((FLG_VEC) * (const FLG_NAME(loose_)*)(p))
#define FLG_STORE(p, x) (*(FLG_NAME(loose_)*)(p) = (x))
#else
#define FLG_LOAD(p) (*(p))
#define FLG_STORE(p, x) (*(p) = (x))
#endif

/* Stores x0 y0 z0 x1 y1 z1 ...: each third of the output takes its x and y in one shuffle and its z in a second. */
#if FLG_N == 4
#define FLG_EACH(m, t) m(t, 0), m(t, 1), m(t, 2), m(t, 3)
#elif FLG_N == 8
#define FLG_EACH(m, t) m(t, 0), m(t, 1), m(t, 2), m(t, 3), m(t, 4), m(t, 5), m(t, 6), m(t, 7)
#elif FLG_N == 16
#define FLG_EACH(m, t)                                                                                                 \
    m(t, 0), m(t, 1), m(t, 2), m(t, 3), m(t, 4), m(t, 5), m(t, 6), m(t, 7), m(t, 8), m(t, 9), m(t, 10), m(t, 11),      \
        m(t, 12), m(t, 13), m(t, 14), m(t, 15)
#endif
#define FLG_POINT(t, i) (((t)*FLG_N + (i)) / 3)
#define FLG_AXIS(t, i) (((t)*FLG_N + (i)) % 3)
#define FLG_TAKE_XY(t, i) ((FLG_AXIS(t, i) == 1 ? FLG_N : 0) + FLG_POINT(t, i))
#define FLG_TAKE_Z(t, i) (FLG_AXIS(t, i) == 2 ? FLG_N + FLG_POINT(t, i) : (i))
#define FLG_THIRD(t)                                                                                                   \
    FLG_STORE(p + (t)*FLG_N, __builtin_shufflevector(__builtin_shufflevector(x, y, FLG_EACH(FLG_TAKE_XY, t)), z,       \
                                                     FLG_EACH(FLG_TAKE_Z, t)))
FLG_HERE void FLG_NAME(store_points_)(float* p, FLG_VEC x, FLG_VEC y, FLG_VEC z) {
#if FLG_N > 1
    FLG_THIRD(0);
    FLG_THIRD(1);
    FLG_THIRD(2);
#else
    p[0] = x;
    p[1] = y;
    p[2] = z;
#endif
}

FLG_TARGET FLG_APART void FLG_NAME(set_cell_)(flg_cell* cell, const uint32_t* corners,
                                              const flg_transform* transforms) {
    const float *t0 = transforms[corners[0]].t, *t1 = transforms[corners[1]].t, *t2 = transforms[corners[2]].t;
    for (int k = 0; k < 16; k += FLG_N) {
        const FLG_VEC first = FLG_LOAD(t0 + k);
        FLG_STORE(cell->base + k, first);
        FLG_STORE(cell->du + k, FLG_LOAD(t1 + k) - first);
        FLG_STORE(cell->dv + k, FLG_LOAD(t2 + k) - first);
    }
}

#define FLG_BLEND(row) (cell->base[row] + u * cell->du[row] + v * cell->dv[row])

/* Restores the records of one run; writes whole groups of FLG_N, so up to FLG_N - 1 points past the run's end. Normals
 * go to `normals` from `first` on. */
FLG_HERE void FLG_NAME(restore_run_)(const flg_records* records, const flg_run* run, const flg_cell* cell,
                                     float* FLG_RESTRICT positions, flg_long_normals* FLG_RESTRICT normals,
                                     size_t first, int with_positions, int with_normals) {
    for (uint32_t k = 0; k < run->count; k += FLG_N) {
        const size_t r = (size_t)run->first + k;
        const FLG_VEC u = FLG_LOAD(records->u + r), v = FLG_LOAD(records->v + r);
        FLG_VEC a[9];
        FLG_PREFETCH(records->u + r + FLG_AHEAD);
        FLG_PREFETCH(records->v + r + FLG_AHEAD);
        for (int i = 0; i < 9; ++i) a[i] = FLG_BLEND(3 + i);
        if (with_positions) {
            FLG_VEC q[3], p[3];
            for (int i = 0; i < 3; ++i) {
                FLG_PREFETCH(records->q[i] + r + FLG_AHEAD);
                q[i] = FLG_LOAD(records->q[i] + r);
            }
            for (int i = 0; i < 3; ++i) p[i] = FLG_BLEND(i) + (a[i] * q[0] + a[3 + i] * q[1] + a[6 + i] * q[2]);
            FLG_NAME(store_points_)(positions + 3 * k, p[0], p[1], p[2]);
        }
        if (with_normals) {
            const FLG_VEC n0 = FLG_LOAD(records->normal[0] + r), n1 = FLG_LOAD(records->normal[1] + r),
                          n2 = FLG_LOAD(records->normal[2] + r);
            for (int i = 0; i < 3; ++i) { /* cofactor: columns a1 x a2, a2 x a0, a0 x a1 */
                const int j = (i + 1) % 3, l = (i + 2) % 3;
                FLG_STORE(normals->at[i] + first + k, (a[3 + j] * a[6 + l] - a[3 + l] * a[6 + j]) * n0 +
                                                          (a[6 + j] * a[l] - a[6 + l] * a[j]) * n1 +
                                                          (a[j] * a[3 + l] - a[l] * a[3 + j]) * n2);
            }
        }
    }
}

/* 1 / sqrt(x) for x > 0 to float precision: a first guess from the exponent and three Newton steps, each of which
 * doubles the digits. Plain arithmetic, since the processors' own instructions differ. */
FLG_HERE FLG_VEC FLG_NAME(inverse_sqrt_)(FLG_VEC x) {
#if FLG_N > 1
    FLG_VEC y = (FLG_VEC)(0x5f3759df - ((FLG_NAME(ints_))x >> 1));
#else
    int32_t bits;
    float y;
    memcpy(&bits, &x, sizeof bits);
    bits = 0x5f3759df - (bits >> 1);
    memcpy(&y, &bits, sizeof y);
#endif
    for (int step = 0; step < 3; ++step) y = y * (1.5f - 0.5f * x * y * y);
    return y;
}

/* x where it is the larger of the two, else the least float. */
FLG_HERE FLG_VEC FLG_NAME(at_least_tiny_)(FLG_VEC x) {
#if FLG_N > 1
    const FLG_VEC zero = {0}, tiny = zero + FLT_MIN;
    const FLG_NAME(ints_) larger = (FLG_NAME(ints_))(x > tiny);
    return (FLG_VEC)(((FLG_NAME(ints_))x & larger) | ((FLG_NAME(ints_))tiny & ~larger));
#else
    return x > FLT_MIN ? x : FLT_MIN;
#endif
}

/* Gives normals length one, in a loop of its own: the root's latency is long, and here several are under way at once.
 * A zero normal stays zero. */
FLG_TARGET FLG_APART void FLG_NAME(store_unit_)(const flg_long_normals* normals, size_t count, float scale,
                                                float* points, size_t room) {
    for (size_t k = 0; k < count; k += FLG_N) {
        const FLG_VEC n0 = scale * FLG_LOAD(normals->at[0] + k), n1 = scale * FLG_LOAD(normals->at[1] + k),
                      n2 = scale * FLG_LOAD(normals->at[2] + k);
        const FLG_VEC length = FLG_NAME(inverse_sqrt_)(FLG_NAME(at_least_tiny_)(n0 * n0 + n1 * n1 + n2 * n2));
        float rest[3 * FLG_N];
        const int fits = k + FLG_N <= room;
        FLG_NAME(store_points_)(fits ? points + 3 * k : rest, n0 * length, n1 * length, n2 * length);
        if (!fits) memcpy(points + 3 * k, rest, (count - k) * 3 * sizeof(float));
    }
}

FLG_HERE void FLG_NAME(restore_some_)(const flg_records* records, const flg_transform* transforms, flg_scales scales,
                                      size_t run_begin, size_t run_end, flg_place positions, flg_place normals,
                                      int with_positions, int with_normals) {
    flg_long_normals long_normals;
    float last[3 * (FLG_MAX_RUN + FLG_PADDING)];
    flg_cell cell;
    while (run_begin < run_end) {
        size_t count = 0; /* of this group */
        for (; run_begin < run_end; ++run_begin) {
            const flg_run* run = records->runs + run_begin;
            if (count + run->count > FLG_GROUP) break;
            FLG_NAME(set_cell_)(&cell, records->cells + 3 * (size_t)run->cell, transforms);
            const int fits = !with_positions || count + run->count + FLG_N - 1 <= positions.room;
            float* const to = with_positions && fits ? positions.points + 3 * count : last;
            FLG_NAME(restore_run_)(records, run, &cell, to, &long_normals, count, with_positions, with_normals);
            if (!fits) memcpy(positions.points + 3 * count, last, run->count * 3 * sizeof(float));
            count += run->count;
        }
        if (with_normals) {
            FLG_NAME(store_unit_)(&long_normals, count, scales.normal, normals.points, normals.room);
            normals.points += 3 * count;
            normals.room -= count;
        }
        if (with_positions) {
            if (scales.position != 1) scale_points(positions.points, count, scales.position);
            positions.points += 3 * count;
            positions.room -= count;
        }
    }
}

FLG_TARGET static void FLG_NAME(restore_runs_)(const flg_records* records, const flg_transform* transforms,
                                               flg_scales scales, size_t run_begin, size_t run_end, flg_place positions,
                                               flg_place normals) {
    if (normals.points) /* without positions where corners have normals of their own: not worth a loop of its own */
        FLG_NAME(restore_some_)
    (records, transforms, scales, run_begin, run_end, positions, normals, positions.points != NULL, 1);
    else FLG_NAME(restore_some_)(records, transforms, scales, run_begin, run_end, positions, normals, 1, 0);
}

FLG_TARGET static void FLG_NAME(subtract_row_)(double* FLG_RESTRICT to, const double* FLG_RESTRICT from, double factor,
                                               size_t count) {
#if FLG_N > 1
    typedef double loose_doubles __attribute__((vector_size(32), aligned(8), may_alias));
    for (size_t k = 0; k < count; k += 4)
        *(loose_doubles*)(to + k) = *(loose_doubles*)(to + k) - factor * *(const loose_doubles*)(from + k);
#else
    for (size_t k = 0; k < count; ++k) to[k] -= factor * from[k];
#endif
}

/* The rows of the gradient: sums over the vertices of (place - centre) times weight, term by term. */
FLG_TARGET static void FLG_NAME(sum_terms_)(const double* weights, const uint32_t* vertices, size_t count,
                                            const float* positions, const float* centre, double rows[12]) {
#if FLG_N > 1
    typedef double loose_doubles __attribute__((vector_size(32), aligned(8), may_alias));
    typedef double doubles __attribute__((vector_size(32)));
    doubles row0 = {0, 0, 0, 0}, row1 = row0, row2 = row0;
#define FLG_ADD(row, weight, d) row += (d) * (weight)
    for (size_t k = 0; k < count; ++k) {
        const doubles weight = (doubles) * (const loose_doubles*)(weights + 4 * k);
#else
    double *row0 = rows, *row1 = rows + 4, *row2 = rows + 8;
    for (int i = 0; i < 12; ++i) rows[i] = 0;
#define FLG_ADD(row, weight, d)                                                                                        \
    for (int i = 0; i < 3; ++i) row[i] += (d) * (weight)[i]
    for (size_t k = 0; k < count; ++k) {
        const double* weight = weights + 4 * k;
#endif
        const float* p = positions + 3 * (size_t)vertices[k];
        const double x = (double)p[0] - (double)centre[0], y = (double)p[1] - (double)centre[1],
                     z = (double)p[2] - (double)centre[2];
        FLG_ADD(row0, weight, x);
        FLG_ADD(row1, weight, y);
        FLG_ADD(row2, weight, z);
    }
#undef FLG_ADD
#if FLG_N > 1
    *(loose_doubles*)rows = row0;
    *(loose_doubles*)(rows + 4) = row1;
    *(loose_doubles*)(rows + 8) = row2;
#endif
}

static const flg_kernel FLG_NAME(kernel_) = {FLG_N, FLG_NAME(restore_runs_), FLG_NAME(subtract_row_),
                                             FLG_NAME(sum_terms_)};

#undef FLG_JOIN2
#undef FLG_JOIN
#undef FLG_NAME
#undef FLG_HERE
#undef FLG_VEC
#undef FLG_LOAD
#undef FLG_STORE
#undef FLG_EACH
#undef FLG_POINT
#undef FLG_AXIS
#undef FLG_TAKE_XY
#undef FLG_TAKE_Z
#undef FLG_THIRD
#undef FLG_BLEND
