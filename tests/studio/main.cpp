// Runs the studio's tests on a display of their own, unless one is given.
#include "script.h"

#include <QApplication>

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <optional>
#include <string>
#include <string_view>

#include <gtest/gtest.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

namespace {

/// An X server without a screen, for as long as this stands.
class VirtualDisplay {
public:
    /// Xvfb chooses a free number and writes it down; when it cannot be started the variable stays unset.
    VirtualDisplay() {
        int number[2];
        if (::pipe(number) != 0) return;
        server_ = ::fork();
        if (server_ == 0) {
            ::prctl(PR_SET_PDEATHSIG, SIGTERM);
            ::close(number[0]);
            if (std::freopen("/dev/null", "w", stderr) == nullptr) ::_exit(1);
            const std::string descriptor = std::to_string(number[1]);
            ::execlp("Xvfb", "Xvfb", "-displayfd", descriptor.c_str(), "-screen", "0", "1600x1200x24", "-nolisten",
                     "tcp", "+extension", "GLX", static_cast<char*>(nullptr));
            ::_exit(127);
        }
        ::close(number[1]);
        std::string text;
        for (char c = 0; ::read(number[0], &c, 1) == 1 && c != '\n';) text += c;
        ::close(number[0]);
        if (!text.empty()) ::setenv("DISPLAY", (":" + text).c_str(), 1);
    }
    ~VirtualDisplay() {
        if (server_ <= 0) return;
        ::kill(server_, SIGTERM);
        while (::waitpid(server_, nullptr, 0) < 0 && errno == EINTR) {
        }
    }
    VirtualDisplay(const VirtualDisplay&) = delete;
    VirtualDisplay& operator=(const VirtualDisplay&) = delete;

private:
    pid_t server_ = -1;
};

} // namespace

int main(int argc, char** argv) {
    testing::InitGoogleTest(&argc, argv);
    if (GTEST_FLAG_GET(list_tests)) return RUN_ALL_TESTS(); // needs no display
    std::optional<VirtualDisplay> display;
    if (!std::getenv("DISPLAY") && !std::getenv("QT_QPA_PLATFORM")) {
        display.emplace();
        if (!std::getenv("DISPLAY")) {
            std::fprintf(stderr, "studio_test: Xvfb cannot be started; apt-get install xvfb, or set DISPLAY.\n");
            return 1;
        }
    }
    filigree::studio::prepare_application();
    QApplication application(argc, argv);
    return RUN_ALL_TESTS();
}
