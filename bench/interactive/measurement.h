// What a benchmark measured: figures with names and units, and tables.
#pragma once

#include <string>
#include <variant>
#include <vector>

namespace filigree::bench {

/// A speed, a time or a ratio under its name, such as "restore.float" in "vertices/s".
struct Measurement {
    std::string name;
    double value;
    std::string unit;
};

/// What does not fit one figure under one name: rows of words and numbers.
struct Table {
    std::string name; ///< in JSON the key of an array, with an object a row
    std::vector<std::string> columns;
    std::vector<std::vector<std::variant<std::string, double>>> rows; ///< one value a column
};

struct Measured {
    std::vector<Measurement> results;
    std::vector<Table> tables;
};

} // namespace filigree::bench
