// LEMON as Debian configures it, but for locks: WASI has one thread.
#include_next <lemon/config.h>
#undef LEMON_USE_PTHREAD
