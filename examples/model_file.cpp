// A stripped mesh in a file: write it, read it, restore from it; a damaged file is refused with a reason.
#include <filigree/filigree.h>

#include <cstdio>

using namespace filigree;

int main() {
    const RunContext context;
    const StripOptions options{.base = 500};
    const Model model = strip(make_wavy_sphere({.resolution = 64}), options, context).value().model;
    if (const Status written = write_model(model, "sphere.fil", context); !written) {
        std::fprintf(stderr, "%s\n", written.error().message.c_str());
        return static_cast<int>(written.error().code);
    }

    const Model read = read_model("sphere.fil", context).value();
    const auto restore_at_rest = [&](const Model& m) {
        return Restorer::create(m, {}, context).value().positions(rest_pose(m), context).value();
    };
    const bool is_same = restore_at_rest(read) == restore_at_rest(model);

    std::string bytes = write_model(model);
    bytes[bytes.size() / 2] ^= 1;
    const Result<Model> damaged = read_model(bytes, "damaged.fil", context);
    std::printf("%zu bytes; restores the same: %s\n%s\n", bytes.size(), is_same ? "yes" : "no",
                damaged ? "the damage went unnoticed" : damaged.error().message.c_str());
    return is_same && !damaged && damaged.error().code == ErrorCode::bad_file ? 0 : 1;
}
