// Models of the reference code in files: a .fil whose detail is the report's (docs/fil-format.md).
#pragma once

#include "filigree/io/file.h"
#include "filigree/reference/reference_model.h"

namespace filigree {

/// Reads a model; nothing in the file is trusted, see read_model. ModelOutline::references says beforehand which code a
/// file has, and read_model_level gives levels of both. Errors: as read_model; unsuitable (a file of the blend code).
Result<ReferenceModel> read_reference_model(const FileReader& file, const std::string& name, const RunContext& context);
/// "-" is standard input.
Result<ReferenceModel> read_reference_model(const std::filesystem::path& path, const RunContext& context);

/// The bytes of the file. The same model gives the same bytes.
std::string write_reference_model(const ReferenceModel& model);
/// Through a temporary file and a rename; "-" is standard output. Errors: unwritable, out_of_memory, cancelled.
Status write_reference_model(const ReferenceModel& model, const std::filesystem::path& path, const RunContext& context);

} // namespace filigree
