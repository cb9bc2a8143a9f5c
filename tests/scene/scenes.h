// Small scenes in a folder of their own.
#pragma once

#include "filigree/scene/scene_run.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

namespace filigree_test {

/// A small cube above the ground.
inline const std::string kDrop =
    "[simulation]\nframes = 6\n[[body]]\nname = \"cube\"\nshape = \"wavy-cube\"\nresolution = 8\nparticles = 200\n"
    "driver = 60\nyoung_modulus = 5e4\ncentre = [0, 0.62, 0]\nvelocity = [0.5, -4, 0]\n[[obstacle]]\nshape = "
    "\"ground\"\n";

class Scenes : public testing::Test {
protected:
    void SetUp() override {
        const testing::TestInfo& test = *testing::UnitTest::GetInstance()->current_test_info();
        folder_ = std::filesystem::temp_directory_path() / (std::string("filigree_scenes_") + test.name());
        std::filesystem::create_directories(folder_);
    }
    void TearDown() override { std::filesystem::remove_all(folder_); }

    std::string write(const std::string& text) const {
        const std::string path = (folder_ / "scene.toml").string();
        std::ofstream(path) << text;
        return path;
    }
    /// The path of a file in the scene's folder.
    std::string beside(const std::string& name) const { return (folder_ / name).string(); }
    filigree::SceneFile scene(const std::string& text) const { return filigree::read_scene(write(text)).value(); }
    /// The sentence that a scene is refused with, from its line on.
    std::string refusal(const std::string& text) const {
        const auto scene = filigree::read_scene(write(text));
        if (scene) return "";
        const std::string& message = scene.error().message;
        return message.substr(message.find(".toml:") + 6);
    }

private:
    std::filesystem::path folder_;
};

} // namespace filigree_test
