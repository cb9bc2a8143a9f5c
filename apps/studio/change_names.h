// What the history calls a change: "Bend", "Frequency 7", "Gravity off".
#pragma once

#include "document.h"

namespace filigree::studio {

QString name_of_change(const Warps& before, const Warps& after);
QString name_of_change(const Shape& before, const Shape& after);
QString name_of_change(const StripOptions& before, const StripOptions& after);
QString name_of_change(const BodySettings& before, const BodySettings& after);

} // namespace filigree::studio
