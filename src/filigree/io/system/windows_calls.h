// The calls of Windows, without its macros `min` and `max`. Sources for Windows alone include it.
#pragma once

#define WIN32_LEAN_AND_MEAN
#ifndef NOMINMAX
#define NOMINMAX
#endif
#include <windows.h>
