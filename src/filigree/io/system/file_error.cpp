#include "filigree/io/system/file_error.h"

#include <cerrno>

namespace filigree {

std::string cause_of(int error_number) {
    switch (error_number) {
    case ENOENT:
        return "there is no such file or folder";
    case ENOTDIR:
        return "a part of its path is not a folder";
    case EISDIR:
        return "it is a folder";
    case EACCES:
    case EPERM:
        return "permission is denied";
    case EROFS:
        return "the file system is read-only";
    case ENOSPC:
        return "the disk is full; make room or write elsewhere";
#if defined(EDQUOT)
    case EDQUOT:
        return "the disk quota is used up; make room or write elsewhere";
#endif
    case EFBIG:
        return "the file is larger than allowed here";
    case ENAMETOOLONG:
        return "the name is too long";
    case ELOOP:
        return "its symbolic links go round in a circle";
    case EPIPE:
        return "the reader has gone away";
    case EIO:
        return "the device failed";
    default:
        return "the system says error " + std::to_string(error_number);
    }
}

Error cannot_read(const std::filesystem::path& path, int error_number) {
    return {ErrorCode::not_found, path.string() + ": cannot be read: " + cause_of(error_number) + "."};
}

Error cannot_write(const std::filesystem::path& path, const std::string& cause) {
    return {ErrorCode::unwritable, path.string() + ": cannot be written: " + cause + "."};
}

Error renamed(Error error, const std::filesystem::path& from, const std::filesystem::path& to) {
    if (error.message.starts_with(from.string())) error.message.replace(0, from.string().size(), to.string());
    return error;
}

} // namespace filigree
