/* Detail in a program without C++: opens a model with the runtime, bends its driver, and writes the restored mesh.
 *   restore_in_c MODEL.fil OUT.obj
 * Needs filigree_rt.h and filigree_rt.c alone. A simulator would move the driver instead of bend(). */
#include "filigree_rt.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

static void fail(const char* what) {
    fprintf(stderr, "restore_in_c: %s\n", what);
    exit(1);
}

static void* take(size_t bytes) {
    void* memory = malloc(bytes > 0 ? bytes : 1);
    if (!memory) fail("there is not enough memory");
    return memory;
}

static unsigned char* read_file(const char* path, size_t* size) {
    FILE* file = fopen(path, "rb");
    long end = -1;
    unsigned char* bytes;
    if (file && fseek(file, 0, SEEK_END) == 0) end = ftell(file);
    if (end < 0) fail("the model cannot be read");
    rewind(file);
    *size = (size_t)end;
    bytes = take(*size);
    if (fread(bytes, 1, *size, file) != *size) fail("the model cannot be read");
    fclose(file);
    return bytes;
}

/* Bends space about the z axis: what was along x follows an arc. */
static void bend(const float* rest, float* moved, uint32_t count) {
    for (uint32_t i = 0; i < count; ++i) {
        const float x = rest[3 * i], y = rest[3 * i + 1], radius = 1.5f - y;
        moved[3 * i] = radius * sinf(x);
        moved[3 * i + 1] = 1.5f - radius * cosf(x);
        moved[3 * i + 2] = rest[3 * i + 2];
    }
}

int main(int argc, char** argv) {
    size_t size;
    unsigned char* bytes;
    flg_model* model;
    flg_info info = {.struct_size = sizeof info};
    flg_status status;
    FILE* out;
    if (argc != 3) fail("usage: restore_in_c MODEL.fil OUT.obj");

    /* Once: open the model, and get memory for a pose and its mesh. */
    bytes = read_file(argv[1], &size);
    status = flg_open(bytes, size, NULL, &model);
    if (status != FLG_OK) fail(flg_status_text(status));
    free(bytes);
    flg_get_info(model, &info);
    float* driver = take(12 * (size_t)info.driver_vertices);
    float* positions = take(12 * (size_t)info.vertices);
    float* normals = take(12 * (size_t)info.normals);
    void* pose = take(flg_pose_bytes(model));
    void* scratch = take(flg_scratch_bytes(model));

    /* For each frame: move the driver, restore. */
    bend(flg_driver_rest(model), driver, info.driver_vertices);
    status = flg_set_pose(model, driver, NULL, info.driver_vertices, pose);
    if (status == FLG_OK) status = flg_restore(model, pose, positions, normals, scratch);
    if (status != FLG_OK) fail(flg_status_text(status));

    out = fopen(argv[2], "w");
    if (!out) fail("the mesh cannot be written");
    for (uint32_t v = 0; v < info.vertices; ++v)
        fprintf(out, "v %.9g %.9g %.9g\n", positions[3 * v] + info.origin[0], positions[3 * v + 1] + info.origin[1],
                positions[3 * v + 2] + info.origin[2]);
    for (uint32_t t = 0; t < info.triangles; ++t)
        fprintf(out, "f %u %u %u\n", flg_triangles(model)[3 * t] + 1, flg_triangles(model)[3 * t + 1] + 1,
                flg_triangles(model)[3 * t + 2] + 1);
    if (fclose(out) != 0) fail("the mesh cannot be written");
    printf("%u vertices follow %u driver vertices\n", (unsigned)info.vertices, (unsigned)info.driver_vertices);

    flg_close(model);
    free(driver);
    free(positions);
    free(normals);
    free(pose);
    free(scratch);
    return 0;
}
