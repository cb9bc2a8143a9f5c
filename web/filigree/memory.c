/* Memory for the runtime in WebAssembly, a fraction of the C library's allocator: free blocks in the order of their
 * addresses, the first that is large enough is taken. A model needs some hundred blocks, so searching costs nothing. */
#include <stddef.h>
#include <stdint.h>

typedef struct block {
    size_t size; /* with this head, a multiple of 16 */
    struct block* next;
} block;

enum { HEAD = 16, PAGE = 65536 };

extern unsigned char __heap_base;
static block* first_free;
static uintptr_t heap_end; /* 0: nothing was taken yet */

void free(void* memory);

/* Puts so many bytes more behind the heap, among the free ones. */
static int grow(size_t bytes) {
    const uintptr_t room = (uintptr_t)__builtin_wasm_memory_size(0) * PAGE;
    block* made;
    if (heap_end == 0) heap_end = ((uintptr_t)&__heap_base + HEAD - 1) / HEAD * HEAD;
    if (bytes > room - heap_end) {
        const size_t pages = (bytes - (room - heap_end)) / PAGE + 1;
        if (__builtin_wasm_memory_grow(0, pages) == SIZE_MAX) return 0;
    }
    made = (block*)heap_end;
    made->size = bytes;
    heap_end += bytes;
    free((unsigned char*)made + HEAD);
    return 1;
}

void* malloc(size_t bytes) {
    const size_t size = (bytes + HEAD + HEAD - 1) / HEAD * HEAD;
    block** at;
    if (bytes > SIZE_MAX / 2) return NULL;
    do
        for (at = &first_free; *at; at = &(*at)->next) {
            block* found = *at;
            if (found->size < size) continue;
            if (found->size - size <= HEAD) {
                *at = found->next;
            } else {
                block* rest = (block*)((unsigned char*)found + size);
                rest->size = found->size - size;
                rest->next = found->next;
                *at = rest;
                found->size = size;
            }
            return (unsigned char*)found + HEAD;
        }
    while (grow(size));
    return NULL;
}

void free(void* memory) {
    block *made, *before = NULL, *after = first_free;
    if (!memory) return;
    made = (block*)((unsigned char*)memory - HEAD);
    for (; after && after < made; after = after->next) before = after;
    made->next = after;
    if (after && (unsigned char*)made + made->size == (unsigned char*)after) {
        made->size += after->size;
        made->next = after->next;
    }
    if (before && (unsigned char*)before + before->size == (unsigned char*)made) {
        before->size += made->size;
        before->next = made->next;
    } else if (before) {
        before->next = made;
    } else {
        first_free = made;
    }
}
