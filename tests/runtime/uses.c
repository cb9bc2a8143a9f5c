/* The runtime in C, with the header alone: the ten lines of docs/runtime.md. */
#include "filigree_rt.h"

#include <stdlib.h>

uint64_t filigree_rt_from_c(const void* bytes, size_t size);

/* Opens a model, moves its driver to twice its width and restores it; a sum over the positions' bytes, 0 after an
 * error. */
uint64_t filigree_rt_from_c(const void* bytes, size_t size) {
    flg_model* model = NULL;
    flg_info info = {.struct_size = sizeof info};
    uint64_t sum = 0;
    if (flg_open(bytes, size, NULL, &model) != FLG_OK) return 0;
    if (flg_get_info(model, &info) == FLG_OK) {
        float* driver = malloc(12 * (size_t)info.driver_vertices);
        float* positions = malloc(12 * (size_t)info.vertices);
        void* pose = malloc(flg_pose_bytes(model));
        void* scratch = malloc(flg_scratch_bytes(model));
        if (driver && positions && pose && scratch) {
            for (size_t k = 0; k < 3 * (size_t)info.driver_vertices; ++k)
                driver[k] = flg_driver_rest(model)[k] * (k % 3 == 0 ? 2.0f : 1.0f);
            if (flg_set_pose(model, driver, NULL, info.driver_vertices, pose) == FLG_OK &&
                flg_restore(model, pose, positions, NULL, scratch) == FLG_OK)
                for (size_t k = 0; k < 12 * (size_t)info.vertices; ++k) sum = sum * 31 + ((unsigned char*)positions)[k];
        }
        free(driver);
        free(positions);
        free(pose);
        free(scratch);
    }
    flg_close(model);
    return sum;
}
