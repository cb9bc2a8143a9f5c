// What is thrown in a module of the page.
#pragma once

#include <string>
#include <string_view>

namespace filigree {

/// What to tell the visitor of something else than an Error that was thrown: each module says it. type: as the compiler
/// names it. "": memory has run out.
std::string sentence_of(const void* thrown, std::string_view type);

} // namespace filigree
