/* Restores models and prints a sum over all bytes that come out: the same line wherever and however it is compiled.
 *   bytes MODEL.fil...
 */
#include "filigree_rt.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static uint64_t add_bytes(uint64_t sum, const void* bytes, size_t size) { /* FNV */
    const unsigned char* p = (const unsigned char*)bytes;
    for (size_t k = 0; k < size; ++k) sum = (sum ^ p[k]) * 1099511628211ull;
    return sum;
}

/* A number from -1 to 1 that depends on k alone. */
static float any(uint32_t k) {
    k = (k ^ 61) ^ (k >> 16);
    k *= 9;
    k ^= k >> 4;
    k *= 0x27d4eb2du;
    k ^= k >> 15;
    return (float)(int32_t)k / 2147483648.0f;
}

static void* take(size_t size) {
    void* memory = malloc(size > 0 ? size : 1);
    if (!memory) exit(1);
    return memory;
}

static void* read_file(const char* path, size_t* size) {
    FILE* file = fopen(path, "rb");
    void* bytes;
    if (!file || fseek(file, 0, SEEK_END) != 0) exit(1);
    *size = (size_t)ftell(file);
    rewind(file);
    bytes = take(*size);
    if (fread(bytes, 1, *size, file) != *size) exit(1);
    fclose(file);
    return bytes;
}

/* By every width there is: their sums have to be the same. */
static uint64_t sum_of(const void* bytes, size_t size, uint32_t lanes, int* there) {
    flg_options options = {sizeof(flg_options), 0, FLG_FINEST, 0, NULL, NULL, NULL};
    flg_model* model;
    flg_info info;
    float *driver, *positions, *normals;
    void *pose, *scratch;
    uint64_t sum = 14695981039346656037ull;
    flg_status status;
    options.lanes = lanes;
    status = flg_open(bytes, size, &options, &model);
    *there = status != FLG_ARGUMENT;
    if (!*there) return 0;
    if (status != FLG_OK) {
        fprintf(stderr, "bytes: %s\n", flg_status_text(status));
        exit(1);
    }
    info.struct_size = sizeof info;
    flg_get_info(model, &info);
    driver = (float*)take(12 * (size_t)info.driver_vertices);
    positions = (float*)take(12 * (size_t)info.vertices);
    normals = (float*)take(12 * (size_t)info.normals);
    pose = take(flg_pose_bytes(model));
    scratch = take(flg_scratch_bytes(model));
    for (uint32_t frame = 0; frame < 3; ++frame) { /* products are powers of two: fused or not, the pose is the same */
        for (uint32_t k = 0; k < 3 * info.driver_vertices; ++k)
            driver[k] = flg_driver_rest(model)[k] * (float)(1 << frame) + 0.0625f * any(k + 977 * frame);
        if (flg_set_pose(model, driver, NULL, info.driver_vertices, pose) != FLG_OK ||
            flg_restore(model, pose, positions, normals, scratch) != FLG_OK)
            exit(1);
        sum = add_bytes(sum, positions, 12 * (size_t)info.vertices);
        sum = add_bytes(sum, normals, 12 * (size_t)info.normals);
    }
    free(driver);
    free(positions);
    free(normals);
    free(pose);
    free(scratch);
    flg_close(model);
    return sum;
}

int main(int argc, char** argv) {
    static const uint32_t widths[] = {0, 1, 4, 8, 16};
    for (int k = 1; k < argc; ++k) {
        size_t size;
        void* bytes = read_file(argv[k], &size);
        int there;
        const uint64_t sum = sum_of(bytes, size, 0, &there);
        for (size_t w = 1; w < sizeof widths / sizeof widths[0]; ++w)
            if (sum_of(bytes, size, widths[w], &there) != sum && there) {
                fprintf(stderr, "bytes: %u lanes give other bytes\n", (unsigned)widths[w]);
                return 1;
            }
        printf("%016llx\n", (unsigned long long)sum);
        free(bytes);
    }
    return 0;
}
