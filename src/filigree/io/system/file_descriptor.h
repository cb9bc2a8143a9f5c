// An open file of the operating system.
#pragma once

#include "filigree/io/system/platform.h"

#include <utility>

namespace filigree {

/// Closes what it holds. Negative: nothing is open.
class FileDescriptor {
public:
    explicit FileDescriptor(int descriptor = -1) : descriptor_(descriptor) {}
    FileDescriptor(FileDescriptor&& other) noexcept : descriptor_(std::exchange(other.descriptor_, -1)) {}
    FileDescriptor& operator=(FileDescriptor&& other) noexcept {
        std::swap(descriptor_, other.descriptor_);
        return *this;
    }
    ~FileDescriptor() { close(); }

    bool is_open() const { return descriptor_ >= 0; }
    int get() const { return descriptor_; }
    /// False: what was written may be lost, as errno says.
    bool close() { return !is_open() || platform::close(std::exchange(descriptor_, -1)); }

private:
    int descriptor_;
};

} // namespace filigree
