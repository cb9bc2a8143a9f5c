// Models of the report's reference code, as strip, deform and restore make and read them.
#pragma once

#include "session.h"

#include "filigree/io/file.h"
#include "filigree/io/reference_file.h"

namespace filigree::cli {

/// Whether a file has such a model.
bool is_reference_model(const FileReader& file, const std::string& path, const Session& session);
ReferenceModel read_reference(const FileReader& file, const std::string& path, const Session& session);

/// --law
Option law_option(std::optional<HeightLaw>& law);
/// Refuses --law where the model has the blend code.
void refuse_law(const std::string& path, const Session& session);

/// filigree strip --code reference.
void strip_with_reference_code(const std::string& input, const std::string& output, const ReferenceOptions& options,
                               Session& session);

} // namespace filigree::cli
