// One window for all tests of a suite; each begins with the document and the view as they were.
#pragma once

#include "studio/patience.h"
#include "window.h"

#include <QTest>

#include <gtest/gtest.h>

namespace filigree::studio {

class OneWindow : public testing::Test {
protected:
    static void SetUpTestSuite() {
        window = new MainWindow(false);
        window->viewport().set_passes(kPasses);
        window->resize(1280, 800);
        start = window->workbench().state();
    }
    static void TearDownTestSuite() {
        start = {};
        delete window;
    }
    void SetUp() override {
        workbench().wait_until_idle();
        workbench().document().replace(start);
        workbench().view().set({});
    }
    void TearDown() override { workbench().wait_until_idle(); }

    static Workbench& workbench() { return window->workbench(); }

    static inline MainWindow* window = nullptr;
    static inline State start;
};

} // namespace filigree::studio
