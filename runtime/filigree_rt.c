/* The runtime as one source: compile this file alone, as C11 or C++. filigree_rt.h has the interface. */
#include "rt_base.c"
#include "rt_clip.c"
#include "rt_code.c"
#include "rt_fit.c"
#include "rt_kernel.c"
#include "rt_model.c"
#include "rt_symbols.c"
