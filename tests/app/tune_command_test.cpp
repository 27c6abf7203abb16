/// `hybmss tune`, and the wisdom that the other commands read.

#include "tests/program.hpp"

namespace hybmss {
namespace {

bool holds(const std::string& text, const std::string& part) {
    return text.find(part) != std::string::npos;
}

class Tune : public ::testing::Test {
protected:
    void SetUp() override { test::write_text(directory.path() / "s.toml", test::small_scene()); }
    test::ProgramResult run(const std::string& arguments) { return test::run_program(arguments, directory.path()); }
    test::TemporaryDirectory directory;
};

TEST_F(Tune, FillsAFileThatStoredReads) {
    const test::ProgramResult before = run("explain s.toml --effort stored --wisdom w");
    EXPECT_EQ(before.exit_code, 2);
    EXPECT_TRUE(holds(before.errors, "--effort stored: w: cannot be read: No such file")) << before.errors;

    const test::ProgramResult tuned = run("tune s.toml --wisdom w --seconds 0.02 --precision double");
    ASSERT_EQ(tuned.exit_code, 0) << tuned.errors;
    EXPECT_EQ(tuned.errors, "") << "no progress line without a terminal";
    EXPECT_TRUE(holds(tuned.output, "step s.toml double: ")) << tuned.output;
    EXPECT_TRUE(holds(tuned.output, "flat-rows/")) << tuned.output;
    EXPECT_TRUE(holds(tuned.output, "1 entries in w")) << tuned.output;

    const test::ProgramResult stored = run("explain s.toml --effort stored --wisdom w");
    ASSERT_EQ(stored.exit_code, 0) << stored.errors;
    EXPECT_TRUE(holds(stored.output, "effort               stored")) << stored.output;
    EXPECT_TRUE(holds(stored.output, "wisdom for this class of body")) << stored.output;
    EXPECT_TRUE(holds(stored.output, "candidates\n")) << stored.output;

    const test::ProgramResult other = run("explain s.toml --effort stored --wisdom w --precision float");
    EXPECT_EQ(other.exit_code, 2);
    EXPECT_TRUE(holds(other.errors, "none of the 1 entries of the wisdom fits \"step lattice float")) << other.errors;
    EXPECT_EQ(run("run s.toml --effort stored --wisdom w --out out").exit_code, 0);
}

TEST_F(Tune, DamagedWisdomIsRefusedAndMeasuredAnew) {
    ASSERT_EQ(run("tune s.toml --wisdom w --seconds 0.02 --precision double").exit_code, 0);
    std::string text = test::read_text(directory.path() / "w");
    text[text.find("figure = ") + 9] = '0';
    test::write_text(directory.path() / "w", text);

    const test::ProgramResult stored = run("explain s.toml --effort stored --wisdom w");
    EXPECT_EQ(stored.exit_code, 2);
    EXPECT_TRUE(holds(stored.errors, "wisdom refused, damaged: the checksum")) << stored.errors;
    const test::ProgramResult measured = run("explain s.toml --effort measure --wisdom w");
    EXPECT_EQ(measured.exit_code, 0);
    EXPECT_TRUE(holds(measured.errors, "hybmss: warning: w:")) << measured.errors;
    EXPECT_TRUE(holds(measured.output, "measured now")) << measured.output;

    const test::ProgramResult tuned = run("tune s.toml --wisdom w --seconds 0.02 --precision double");
    EXPECT_EQ(tuned.exit_code, 0);
    EXPECT_TRUE(holds(tuned.errors, "it is replaced")) << tuned.errors;
    EXPECT_EQ(run("explain s.toml --effort stored --wisdom w").exit_code, 0);
}

TEST_F(Tune, UsesTheCacheDirectory) {
    ASSERT_EQ(setenv("XDG_CACHE_HOME", (directory.path() / "cache").c_str(), 1), 0);
    const test::ProgramResult tuned = run("tune s.toml --seconds 0.02 --precision float --operation forces --check");
    const test::ProgramResult explained = run("explain s.toml --effort measure --precision float");
    ASSERT_EQ(unsetenv("XDG_CACHE_HOME"), 0);
    ASSERT_EQ(tuned.exit_code, 0) << tuned.errors;
    EXPECT_TRUE(std::filesystem::exists(directory.path() / "cache" / "hybmss" / "wisdom"));
    EXPECT_TRUE(holds(tuned.output, "1.000 times the best")) << tuned.output;
    EXPECT_TRUE(holds(tuned.output, "<- chosen")) << tuned.output;
    EXPECT_TRUE(holds(tuned.output, "<- estimate")) << tuned.output;
    EXPECT_TRUE(holds(tuned.output, "\nof 1: measure at most 3 % slower than estimate ")) << tuned.output;
    EXPECT_TRUE(holds(explained.output, "measured now")) << "forces are not steps: " << explained.output;
}

TEST_F(Tune, BadInput) {
    EXPECT_EQ(run("tune absent.toml --wisdom w").exit_code, 2);
    EXPECT_EQ(run("tune s.toml --matrix --wisdom w").exit_code, 2);
    EXPECT_EQ(run("tune s.toml --wisdom w --layout spaghetti").exit_code, 2);
    EXPECT_EQ(run("explain s.toml --effort patient").exit_code, 2);
    const test::ProgramResult unread = run("explain s.toml --wisdom w");
    EXPECT_EQ(unread.exit_code, 2);
    EXPECT_TRUE(holds(unread.errors, "only --effort measure and --effort stored read wisdom")) << unread.errors;
    EXPECT_FALSE(std::filesystem::exists(directory.path() / "w"));
    const test::ProgramResult nowhere = run("tune s.toml --wisdom absent/w --seconds 0.02");
    EXPECT_EQ(nowhere.exit_code, 2);
    EXPECT_TRUE(holds(nowhere.errors, "--wisdom absent/w: cannot be written: No such file")) << nowhere.errors;
}

} // namespace
} // namespace hybmss
