#if defined(_WIN32)

#include "filigree/render/child_process.h"

#include "filigree/io/system/platform.h"
#include "filigree/io/system/windows_calls.h"

#include <algorithm>
#include <cerrno>
#include <thread>
#include <utility>

namespace filigree {

namespace {

/// Closes what it holds.
class Handle {
public:
    explicit Handle(HANDLE handle = nullptr) : handle_(handle) {}
    Handle(Handle&& other) noexcept : handle_(std::exchange(other.handle_, nullptr)) {}
    Handle& operator=(Handle&& other) noexcept {
        std::swap(handle_, other.handle_);
        return *this;
    }
    ~Handle() { close(); }
    void close() {
        if (handle_) ::CloseHandle(std::exchange(handle_, nullptr));
    }
    HANDLE get() const { return handle_; }

private:
    HANDLE handle_;
};

/// As the C library of the other program takes a line apart: quotes around each word, and before a quote each backslash
/// twice.
std::wstring command_line(const std::vector<std::string>& words) {
    std::wstring line;
    for (const std::string& word : words) {
        if (!line.empty()) line += L' ';
        line += L'"';
        std::size_t backslashes = 0;
        for (const wchar_t c : platform::native_name(word)) {
            if (c == L'"') line.append(backslashes + 1, L'\\');
            backslashes = c == L'\\' ? backslashes + 1 : 0;
            line += c;
        }
        line.append(backslashes, L'\\');
        line += L'"';
    }
    return line;
}

/// One end for us and one for a child. False: there are no more.
bool make_pipe(Handle& to_read, Handle& to_write) {
    HANDLE reads = nullptr, writes = nullptr;
    if (::CreatePipe(&reads, &writes, nullptr, 0) == 0) return false;
    to_read = Handle(reads), to_write = Handle(writes);
    return true;
}

} // namespace

struct ChildProcess::Content {
    Handle process, input, errors;
    std::thread listener; ///< of standard error: else the child could wait for us to listen while we wait for it
    std::string complaint;

    void listen() {
        char bytes[4096];
        for (DWORD got = 0; ::ReadFile(errors.get(), bytes, sizeof bytes, &got, nullptr) != 0 && got > 0;)
            complaint.append(bytes, std::min<std::size_t>(got, kLongestComplaint - complaint.size()));
    }

    DWORD wait() {
        DWORD exit_code = 1;
        ::WaitForSingleObject(process.get(), INFINITE);
        ::GetExitCodeProcess(process.get(), &exit_code);
        if (listener.joinable()) listener.join();
        process.close();
        return exit_code;
    }
};

ChildProcess::ChildProcess() : content_(std::make_unique<Content>()) {}

ChildProcess::~ChildProcess() {
    if (!content_->process.get()) return;
    ::TerminateProcess(content_->process.get(), 1);
    content_->wait();
}

int ChildProcess::start(std::vector<std::string> words) {
    Handle child_input, child_errors;
    if (!make_pipe(child_input, content_->input) || !make_pipe(content_->errors, child_errors)) return EMFILE;
    SECURITY_ATTRIBUTES inherited{sizeof inherited, nullptr, TRUE};
    const Handle nowhere(::CreateFileW(L"NUL", GENERIC_WRITE, FILE_SHARE_READ | FILE_SHARE_WRITE, &inherited,
                                       OPEN_EXISTING, 0, nullptr));
    HANDLE streams[] = {child_input.get(), nowhere.get(), child_errors.get()};
    for (const HANDLE stream : streams) ::SetHandleInformation(stream, HANDLE_FLAG_INHERIT, HANDLE_FLAG_INHERIT);

    // The child has these three and no other handle of ours.
    SIZE_T size = 0;
    ::InitializeProcThreadAttributeList(nullptr, 1, 0, &size);
    std::vector<std::byte> room(size);
    auto* const list = reinterpret_cast<LPPROC_THREAD_ATTRIBUTE_LIST>(room.data());
    if (::InitializeProcThreadAttributeList(list, 1, 0, &size) == 0) return ENOMEM;
    ::UpdateProcThreadAttribute(list, 0, PROC_THREAD_ATTRIBUTE_HANDLE_LIST, streams, sizeof streams, nullptr, nullptr);
    STARTUPINFOEXW start{};
    start.StartupInfo.cb = sizeof start;
    start.StartupInfo.dwFlags = STARTF_USESTDHANDLES;
    start.StartupInfo.hStdInput = streams[0];
    start.StartupInfo.hStdOutput = streams[1];
    start.StartupInfo.hStdError = streams[2];
    start.lpAttributeList = list;
    std::wstring line = command_line(words);
    PROCESS_INFORMATION child{};
    const bool started = ::CreateProcessW(nullptr, line.data(), nullptr, nullptr, TRUE,
                                          EXTENDED_STARTUPINFO_PRESENT | CREATE_NEW_PROCESS_GROUP | CREATE_NO_WINDOW,
                                          nullptr, nullptr, &start.StartupInfo, &child) != 0;
    const DWORD error = ::GetLastError();
    ::DeleteProcThreadAttributeList(list);
    if (!started)
        return error == ERROR_FILE_NOT_FOUND || error == ERROR_PATH_NOT_FOUND ? ENOENT
               : error == ERROR_ACCESS_DENIED                                 ? EACCES
                                                                              : EIO;
    ::CloseHandle(child.hThread);
    content_->process = Handle(child.hProcess);
    content_->listener = std::thread([content = content_.get()] { content->listen(); });
    return 0;
}

bool ChildProcess::send(std::string_view bytes) {
    while (!bytes.empty()) {
        DWORD sent = 0;
        const auto part = static_cast<DWORD>(std::min<std::size_t>(bytes.size(), 1 << 20));
        if (::WriteFile(content_->input.get(), bytes.data(), part, &sent, nullptr) == 0) return false;
        bytes.remove_prefix(sent);
    }
    return true;
}

bool ChildProcess::finish() {
    content_->input.close();
    return content_->wait() == 0;
}

const std::string& ChildProcess::complaint() const { return content_->complaint; }

} // namespace filigree

#endif
