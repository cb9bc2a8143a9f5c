/* Opens and restores damaged models in any poses: bytes are changed, and the checksums mended, or nothing would get
 * past them. mutate COUNT SEED MODEL.fil...      COUNT: of all models together Built with sanitizers it shows that no
 * file and no pose makes the runtime read or write where it must not. */
#include "filigree_rt.h"
#include "rt_hash.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static uint64_t state;

static uint64_t any(uint64_t below) {
    state ^= state << 13;
    state ^= state >> 7;
    state ^= state << 17;
    return below > 0 ? state % below : 0;
}

typedef struct bytes {
    unsigned char* at;
    size_t size;
} bytes;

static void fail(const char* what) {
    fprintf(stderr, "mutate: %s\n", what);
    exit(1);
}

static bytes read_file(const char* path) {
    bytes read = {NULL, 0};
    FILE* file = fopen(path, "rb");
    long size = 0;
    if (!file || fseek(file, 0, SEEK_END) != 0 || (size = ftell(file)) < 0) fail(path);
    rewind(file);
    read.size = (size_t)size;
    read.at = (unsigned char*)malloc(read.size + 1);
    if (!read.at || fread(read.at, 1, read.size, file) != read.size) fail(path);
    fclose(file);
    return read;
}

static uint64_t number_at(const unsigned char* p, size_t size) {
    uint64_t value = 0;
    memcpy(&value, p, size);
    return value;
}

/* Sums that fit the sections, the table and the length. */
static void mend(bytes file) {
    const uint64_t size = file.size;
    uint64_t sections, sum;
    if (size < 32) return;
    sections = number_at(file.at + 12, 4);
    if (sections > (size - 32) / 40) sections = (size - 32) / 40;
    memcpy(file.at + 12, &sections, 4);
    memcpy(file.at + 16, &size, 8);
    for (uint64_t k = 0; k < sections; ++k) {
        unsigned char* entry = file.at + 32 + 40 * k;
        const uint64_t item = number_at(entry + 12, 4), offset = number_at(entry + 16, 8),
                       count = number_at(entry + 24, 8);
        if (item == 0 || offset > size || count > (size - offset) / item) continue;
        sum = hash_of(file.at + offset, (size_t)(count * item));
        memcpy(entry + 32, &sum, 8);
    }
    sum = hash_of(file.at + 32, (size_t)(40 * sections));
    memcpy(file.at + 24, &sum, 8);
}

static void change_once(bytes* file) {
    static const uint64_t edges[] = {0,          1,          2,          3,          31,         511,        512,
                                     513,        32767,      32768,      65535,      0x7fffffff, 0x80000000, 0xfffffffe,
                                     0xffffffff, 0x7f800000, 0x7fc00000, 0xff800000, 1ull << 40, ~0ull};
    const uint64_t edge = edges[any(sizeof edges / sizeof edges[0])];
    const size_t wide = (size_t)1 << any(4);
    size_t at = (size_t)any(file->size - 8);
    if (any(5) == 0 && file->size > 32) { /* a field of the table */
        const uint64_t sections = number_at(file->at + 12, 4);
        at = 32 + (size_t)(40 * any(sections < (file->size - 40) / 40 ? sections : 1)) + 8 + (size_t)(4 * any(6));
    }
    if (at + 8 > file->size) return;
    switch (any(6)) {
    case 0:
        file->at[at] ^= (unsigned char)(1u << any(8));
        break;
    case 1:
        file->at[at] = (unsigned char)any(256);
        break;
    case 2:
        file->size = at + 8;
        break;
    case 3: { /* a little more or less */
        uint64_t value = number_at(file->at + at, wide) + any(5) - 2;
        memcpy(file->at + at, &value, wide);
        break;
    }
    default:
        memcpy(file->at + at, &edge, wide);
    }
}

static unsigned long long restored; /* models that opened */

/* Numbers of a pose, some of them such as no simulator should give. */
static void spoil(float* x, uint64_t count) {
    static const uint32_t hostile[] = {0x7fc00000, 0x7f800000, 0xff800000, 0x7f7fffff, 0xff7fffff, 1, 0x00800000, 0};
    if (count > 0 && any(2) == 0)
        for (uint64_t times = 1 + any(4); times-- > 0;)
            memcpy(x + any(count), &hostile[any(sizeof hostile / sizeof hostile[0])], sizeof *x);
}

/* Restores with some pose, into memory of exactly the size that was asked for. Returns the status. */
static flg_status try_model(const unsigned char* file, size_t size) {
    const uint32_t lanes[] = {0, 0, 4, 8, 16};
    flg_options options = {sizeof(flg_options), 0, FLG_FINEST, lanes[any(5)], NULL, NULL, NULL};
    flg_model* model;
    flg_info info;
    flg_status status;
    float *positions, *normals, *driver, *gradients;
    static void* scratch; /* the same size for all models; a megabyte, which takes longer to get than to use */
    void* pose;
    options.flags = (uint32_t)any(16);
    if (any(3) == 0) options.level = (uint32_t)any(4);
    status = flg_open(file, size, &options, &model);
    if (status == FLG_ARGUMENT && options.lanes > 0) {
        options.lanes = 0;
        status = flg_open(file, size, &options, &model);
    }
    if (status != FLG_OK) {
        if (model || status == FLG_ARGUMENT) fail("an error without its status");
        return status;
    }
    ++restored;
    info.struct_size = sizeof info;
    if (flg_get_info(model, &info) != FLG_OK) fail("no info");
    driver = (float*)malloc(12 * (size_t)info.driver_vertices);
    gradients = (float*)malloc(36 * (size_t)info.driver_vertices);
    positions = (float*)malloc(12 * (size_t)info.vertices);
    normals = (float*)malloc(12 * (size_t)info.normals);
    pose = malloc(flg_pose_bytes(model));
    if (!scratch) scratch = malloc(flg_scratch_bytes(model));
    if (!driver || !gradients || !pose || !scratch) fail("no memory");
    memcpy(driver, flg_driver_rest(model), 12 * (size_t)info.driver_vertices);
    for (uint32_t k = 0; k < 9 * info.driver_vertices; ++k) gradients[k] = k % 9 % 4 == 0 ? 1.0f : 0.1f;
    if (info.driver_vertices > 2) driver[any(3 * (uint64_t)info.driver_vertices)] += 0.5f;
    if (info.frames > 0)
        flg_read_frame(model, file, size, (uint32_t)any(info.frames), driver,
                       info.frames_have_gradients ? gradients : NULL);
    spoil(driver, 3 * (uint64_t)info.driver_vertices);
    spoil(gradients, 9 * (uint64_t)info.driver_vertices);
    if (flg_set_pose(model, driver, info.has_fit && any(2) ? NULL : gradients, info.driver_vertices, pose) != FLG_OK)
        fail("a pose that fits is refused");
    if (flg_restore(model, pose, positions, info.normals > 0 ? normals : NULL, scratch) != FLG_OK)
        fail("an opened model is not restored");
    {
        uint32_t* drivers = (uint32_t*)malloc(12 * (size_t)info.vertices);
        float *weights = (float*)malloc(12 * (size_t)info.vertices),
              *matrices = (float*)malloc(64 * (size_t)info.driver_vertices);
        const uint32_t first = (uint32_t)any((uint64_t)info.vertices + 1);
        if (!drivers || !weights || !matrices) fail("no memory");
        if (flg_skin_matrices(model, pose, matrices) != FLG_OK ||
            flg_skin(model, first, info.vertices - first, drivers, weights, positions) != FLG_OK)
            fail("an opened model has no skin");
        for (size_t k = 0; k < 3 * (size_t)(info.vertices - first); ++k)
            if (drivers[k] >= info.driver_vertices) fail("a skin has a driver vertex that is not there");
        free(drivers);
        free(weights);
        free(matrices);
    }
    if (info.parts > 0) { /* a part, at a stride, where others would be written by other threads */
        const uint32_t part = (uint32_t)any(info.parts);
        uint32_t first = 0, count = 0;
        float* spaced = (float*)malloc(16 * (size_t)info.vertices);
        if (!spaced || flg_get_part(model, part, &first, &count, NULL, NULL) != FLG_OK) fail("a part is missing");
        if (first > info.vertices || count > info.vertices - first) fail("a part has vertices that are not there");
        if (flg_restore_parts(model, pose, part, 1, spaced, 16, NULL, 12, scratch) != FLG_OK)
            fail("a part is not restored");
        free(spaced);
    }
    {
        static const char* const names[] = {"uv.val", "nrm.val", "col.val", "scal.val", "mat.fac", "mesh.pos"};
        const void* items;
        uint32_t item_size;
        size_t count;
        unsigned sum = 0;
        for (size_t k = 0; k < sizeof names / sizeof names[0]; ++k) {
            if (flg_find_decoded(model, names[k], 0, &items, &item_size, &count) != FLG_OK &&
                flg_find_section(file, size, names[k], 0, &items, &item_size, &count) != FLG_OK)
                continue;
            for (size_t b = 0; b < item_size * count; ++b) sum += ((const unsigned char*)items)[b];
        }
        if (sum == 1) puts("the sum is read"); /* so that nobody leaves it out */
    }
    if (flg_triangle_uvs(model))
        for (size_t k = 0; k < 3 * (size_t)info.triangles; ++k)
            (void)*(volatile const uint32_t*)(flg_triangle_uvs(model) + k);
    if (flg_triangle_faces(model))
        for (size_t k = 0; k < info.triangles; ++k)
            if (flg_triangle_faces(model)[k] >= info.faces) fail("a triangle has a face that is not there");
    if (flg_triangles(model))
        for (size_t k = 0; k < 3 * (size_t)info.triangles; ++k)
            if (flg_triangles(model)[k] >= info.vertices) fail("a triangle has a vertex that is not there");
    if (flg_triangle_normals(model))
        for (size_t k = 0; k < 3 * (size_t)info.triangles; ++k)
            if (flg_triangle_normals(model)[k] >= info.normals && flg_triangle_normals(model)[k] != 0xffffffffu)
                fail("a triangle has a normal that is not there");
    free(driver);
    free(gradients);
    free(positions);
    free(normals);
    free(pose);
    flg_close(model);
    return FLG_OK;
}

int main(int argc, char** argv) {
    unsigned long long count, found[FLG_OLD_RECORDS + 1] = {0};
    if (argc < 4) {
        fprintf(stderr, "Usage: mutate COUNT SEED MODEL.fil...\n");
        return 2;
    }
    count = strtoull(argv[1], NULL, 10);
    state = strtoull(argv[2], NULL, 10) * 0x9e3779b97f4a7c15ull + 1;
    for (int k = 3; k < argc; ++k) {
        const bytes original = read_file(argv[k]);
        for (unsigned long long i = 0; i < count / (unsigned)(argc - 3); ++i) {
            bytes changed = original;
            changed.at = (unsigned char*)malloc(original.size); /* of its own, so that reading past its end is seen */
            if (!changed.at) fail("no memory");
            memcpy(changed.at, original.at, original.size);
            if (i > 0)
                for (uint64_t times = 1 + any(2); times-- > 0 && changed.size > 16;) change_once(&changed);
            if (changed.size < original.size) {
                unsigned char* shorter = (unsigned char*)malloc(changed.size);
                if (!shorter) fail("no memory");
                memcpy(shorter, changed.at, changed.size);
                free(changed.at);
                changed.at = shorter;
            }
            if (any(8) != 0) mend(changed);
            {
                const flg_status status = try_model(changed.at, changed.size);
                if (i == 0 && status != FLG_OK && status != FLG_MISSING) fail(argv[k]);
                ++found[status];
            }
            free(changed.at);
        }
        free(original.at);
    }
    for (int status = 0; status <= FLG_OLD_RECORDS; ++status)
        printf("%9llu  %s\n", found[status], flg_status_text((flg_status)status));
    printf("%9llu  were opened and restored.\n", restored);
    return 0;
}
