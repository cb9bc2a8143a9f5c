// Arrays in files: what was written comes back, in full, in part, one by one; damage is said.
#include "filigree/io/array_file.h"

#include <gtest/gtest.h>
#include <numeric>
#include <unistd.h>

namespace filigree {
namespace {

class ArrayFiles : public testing::Test {
protected:
    std::filesystem::path path_ =
        std::filesystem::temp_directory_path() / ("filigree-arrays-" + std::to_string(::getpid()));
    ~ArrayFiles() override { std::filesystem::remove(path_); }
};

TEST_F(ArrayFiles, ComeBackInFullAndInPart) {
    std::vector<Index> numbers(5000);
    std::iota(numbers.begin(), numbers.end(), 7);
    const std::vector<double> none;
    const std::vector<Vec3f> places{{1, 2, 3}, {4, 5, 6}};
    ASSERT_TRUE(ArrayFile().add(numbers).add(none).add(places).write(path_));
    const ArrayReader file = ArrayReader::open(path_).value();
    EXPECT_EQ(file.count<Index>(0), 5000u);
    EXPECT_EQ(file.count<double>(1), 0u);
    EXPECT_EQ(file.count<Index>(3), 0u);
    EXPECT_EQ(file.read<Index>(0).value(), numbers);
    EXPECT_TRUE(file.read<double>(1).value().empty());
    EXPECT_EQ(file.read<Vec3f>(2).value(), places);
    EXPECT_EQ(file.read<Vec3f>(2, 1, 1).value(), std::vector<Vec3f>{places[1]});
    const std::vector<Index> ask{0, 1, 1023, 1024, 4096, 4999};
    EXPECT_EQ(file.pick<Index>(0, ask).value(), (std::vector<Index>{7, 8, 1030, 1031, 4103, 5006}));
    EXPECT_TRUE(file.pick<Index>(0, {}).value().empty());
}

TEST_F(ArrayFiles, DamageIsSaid) {
    const std::vector<Index> numbers(100, 1);
    ASSERT_TRUE(ArrayFile().add(numbers).write(path_));
    const ArrayReader file = ArrayReader::open(path_).value();
    EXPECT_EQ(file.read<Index>(0, 90, 11).error().code, ErrorCode::bad_file);
    EXPECT_EQ(file.read<Index>(1, 0, 1).error().code, ErrorCode::bad_file);
    EXPECT_EQ(file.pick<Index>(0, std::vector<Index>{3, 2000}).error().code, ErrorCode::bad_file);
    std::filesystem::resize_file(path_, 200);
    EXPECT_EQ(ArrayReader::open(path_).error().code, ErrorCode::bad_file);
    std::filesystem::resize_file(path_, 4);
    EXPECT_FALSE(ArrayReader::open(path_));
    std::filesystem::remove(path_);
    EXPECT_EQ(ArrayReader::open(path_).error().code, ErrorCode::not_found);
}

} // namespace
} // namespace filigree
