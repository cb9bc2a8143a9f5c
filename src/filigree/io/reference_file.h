// Models of the reference code in files: a .fil whose detail is the report's (docs/fil-format.md).
#pragma once

#include "filigree/io/file.h"
#include "filigree/reference.h"

namespace filigree {

/// Reads a model from a file that is open. ModelOutline::references says which code a file has, and read_model_level
/// gives levels of both. name: for messages. Errors: those of read_model; unsuitable (a model of strip()).
Result<ReferenceModel> read_reference_model(const FileReader& file, const std::string& name, const RunContext& context);

} // namespace filigree
