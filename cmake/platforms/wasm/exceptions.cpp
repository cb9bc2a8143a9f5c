// What the compiler and LLVM's C++ ABI library call to throw and to catch, which Debian's library for WASM lacks. The
// engine unwinds: at each place that may catch, the personality is asked which of its handlers, if any, takes the
// exception.
#include <cstddef>
#include <cstdint>
#include <unwind.h>

// The compiler's code fills it where something is caught, and reads the selector.
struct LandingPad {
    std::uintptr_t index, lsda, selector;
};
extern "C" {
thread_local LandingPad __wasm_lpad_context;
_Unwind_Reason_Code __gxx_personality_wasm0(int, _Unwind_Action, std::uint64_t, _Unwind_Exception*, _Unwind_Context*);

_Unwind_Reason_Code _Unwind_CallPersonality(void* thrown) {
    auto* const exception = static_cast<_Unwind_Exception*>(thrown);
    auto* const context = reinterpret_cast<_Unwind_Context*>(&__wasm_lpad_context);
    __wasm_lpad_context.selector = 0;
    const auto call = [&](int actions) {
        return __gxx_personality_wasm0(1, static_cast<_Unwind_Action>(actions), exception->exception_class, exception,
                                       context);
    };
    const _Unwind_Reason_Code found = call(_UA_SEARCH_PHASE);
    return found == _URC_HANDLER_FOUND ? call(_UA_CLEANUP_PHASE | _UA_HANDLER_FRAME) : found;
}
_Unwind_Reason_Code _Unwind_RaiseException(_Unwind_Exception* exception) { __builtin_wasm_throw(0, exception); }
_Unwind_Reason_Code _Unwind_Resume_or_Rethrow(_Unwind_Exception* exception) { __builtin_wasm_throw(0, exception); }
void _Unwind_DeleteException(_Unwind_Exception* exception) {
    if (exception->exception_cleanup) exception->exception_cleanup(_URC_FOREIGN_EXCEPTION_CAUGHT, exception);
}
_Unwind_Word _Unwind_GetIP(_Unwind_Context*) { return __wasm_lpad_context.index + 2; }
void* _Unwind_GetLanguageSpecificData(_Unwind_Context*) { return reinterpret_cast<void*>(__wasm_lpad_context.lsda); }
_Unwind_Ptr _Unwind_GetRegionStart(_Unwind_Context*) { return 0; }
void _Unwind_SetGR(_Unwind_Context*, int index, _Unwind_Word value) {
    if (index == 1) __wasm_lpad_context.selector = value;
}
void _Unwind_SetIP(_Unwind_Context*, _Unwind_Word) {}
}
