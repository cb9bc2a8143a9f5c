#include "filigree/result.h"

#include <gtest/gtest.h>

#include <memory>

using namespace filigree;

namespace {

using Owner = Result<std::unique_ptr<int>>; // cannot be copied
const Error kError{ErrorCode::bad_file, "cow.obj:3: cut off."};

} // namespace

TEST(Result, IsAValueOrAnError) {
    Owner value(std::make_unique<int>(7));
    EXPECT_TRUE(value.ok() && value);
    EXPECT_EQ(**value, 7);
    const std::unique_ptr<int> moved = *std::move(value);
    EXPECT_EQ(*moved, 7);

    const Owner error(kError);
    EXPECT_FALSE(error.ok() || error);
    EXPECT_EQ(error.error().code, ErrorCode::bad_file);
    EXPECT_EQ(error.error().message, kError.message);
    try {
        (void)error.value();
        FAIL() << "a failed result gave a value";
    } catch (const BadResultAccess& thrown) {
        EXPECT_EQ(thrown.what(), kError.message);
        EXPECT_EQ(thrown.error().code, ErrorCode::bad_file);
    }
}

TEST(Result, ATemporarysValueOutlivesIt) {
    const auto make = [] { return Result<std::string>(std::string(100, 'a')); };
    const auto& text = *make();
    EXPECT_EQ(text, std::string(100, 'a')); // the address sanitizer sees it when not
}
