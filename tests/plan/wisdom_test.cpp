// Wisdom: what goes out comes back in, and what is damaged, foreign or stale is refused with a reason and a line.

#include "hybmss/explicit_dynamics.hpp"
#include "hybmss/version.hpp"
#include "hybmss/wisdom.hpp"
#include "plan/tuning/wisdom_store.hpp"
#include "tests/refusal.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <string>

namespace hybmss {
namespace {

WisdomEntry entry(const std::string& choice, double ns) {
    return {*parse_candidate(choice), {{choice, ns, true}, {"network/sse2/exact/threads:3", 4 * ns, false}}};
}

Wisdom two_entries() {
    Wisdom wisdom;
    WisdomStore::put(wisdom, "step one", entry("flat-rows/sse2/fast/threads:1", 6.5));
    WisdomStore::put(wisdom, "step two", entry("network/sse2/exact/threads:2", 31.25));
    return wisdom;
}

/// With the checksum made right again.
std::string with(std::string text, const std::string& part, const std::string& replacement) {
    const std::size_t at = text.find(part);
    EXPECT_NE(at, std::string::npos) << part;
    text.replace(at, part.size(), replacement);
    text.erase(text.rfind("checksum = "));
    return text + wisdom_checksum_line(text);
}

std::size_t line_of(const std::string& text, const std::string& part) {
    return 1 + static_cast<std::size_t>(
                   std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(text.find(part)), '\n'));
}

void expect_refused(const std::string& text, std::size_t line, const std::string& reason) {
    Wisdom wisdom = two_entries();
    const std::string before = wisdom.export_text();
    try {
        wisdom.import_text(text, "file");
    } catch (const WisdomError& error) {
        const std::string message = error.what();
        EXPECT_TRUE(message.starts_with("file:" + std::to_string(line) + ": wisdom refused, " + reason)) << message;
        EXPECT_EQ(message.find('\n'), std::string::npos) << message;
        EXPECT_EQ(wisdom.export_text(), before) << "an import is all or nothing";
        return;
    }
    ADD_FAILURE() << "nothing was refused: " << reason;
}

TEST(Wisdom, ComesBackAsItWent) {
    const Wisdom wisdom = two_entries();
    const auto path = std::filesystem::path(::testing::TempDir()) / "hybmss-wisdom-round-trip";
    wisdom.export_file(path);
    Wisdom back;
    back.import_file(path);
    EXPECT_EQ(back.entries(), 2u);
    EXPECT_EQ(back.export_text(), wisdom.export_text());
    const auto two = WisdomStore::find(back, "step two");
    ASSERT_TRUE(two);
    EXPECT_EQ(name(two->choice), "network/sse2/exact/threads:2");
    ASSERT_EQ(two->figures.size(), 2u);
    EXPECT_EQ(two->figures[0].ns_per_cell_step, 31.25);
    EXPECT_TRUE(two->figures[0].finalist);
    EXPECT_FALSE(two->figures[1].finalist);
    std::filesystem::remove(path);
}

TEST(Wisdom, LeavesNoPartialFile) {
    const auto directory = std::filesystem::path(::testing::TempDir()) / "hybmss-wisdom-partial";
    std::filesystem::create_directories(directory);
    two_entries().export_file(directory / "wisdom");
    EXPECT_EQ(std::distance(std::filesystem::directory_iterator(directory), {}), 1);
    EXPECT_THROW(two_entries().export_file(directory / "absent" / "wisdom"), WisdomError);
    EXPECT_THROW(two_entries().export_file(directory), WisdomError); // a directory cannot be replaced
    for (const auto& file : std::filesystem::directory_iterator(directory.parent_path())) {
        EXPECT_FALSE(file.path().filename().string().starts_with("hybmss-wisdom-partial.partial")) << file.path();
    }
    EXPECT_FALSE(std::filesystem::exists(directory.parent_path() / "absent"));
    std::filesystem::remove_all(directory);
}

TEST(Wisdom, MergesTheOthersEntriesOverItsOwn) {
    Wisdom wisdom = two_entries(), other;
    WisdomStore::put(other, "step two", entry("flat-rows/sse2/fast/threads:4", 1));
    WisdomStore::put(other, "step three", entry("flat-rows/sse2/fast/threads:5", 1));
    wisdom.merge(other);
    EXPECT_EQ(wisdom.entries(), 3u);
    EXPECT_EQ(WisdomStore::find(wisdom, "step two")->choice.threads, 4);
    EXPECT_EQ(WisdomStore::find(wisdom, "step one")->choice.threads, 1);
    EXPECT_EQ(other.entries(), 2u);
    const Wisdom copy = wisdom;
    wisdom = Wisdom();
    EXPECT_EQ(wisdom.entries(), 0u);
    EXPECT_EQ(copy.entries(), 3u);
}

TEST(Wisdom, RefusesWhatIsForeignOrStale) {
    const std::string text = two_entries().export_text();
    expect_refused(with(text, "schema = 4", "schema = 3"), 2, "foreign: written in another schema (there: 3; here: 4)");
    expect_refused(with(text, std::string("version = ") + kVersion, "version = 0.0.9"), 3,
                   "stale: written by another version of hybmss (there: 0.0.9; here: ");
    expect_refused(with(text, "cpu = ", "cpu = Not "), 4, "foreign: measured on another CPU (there: Not ");
    expect_refused(with(text, "instruction_sets = ", "instruction_sets = mmx "), 5,
                   "foreign: measured with other instruction sets (there: mmx ");
    expect_refused(with(text, "lattice_layouts = ", "lattice_layouts = spaghetti "), 6,
                   "stale: measured among other lattice layouts (there: spaghetti ");
    expect_refused(with(text, "network_layouts = ", "network_layouts = macaroni "), 7,
                   "stale: measured among other network layouts (there: macaroni ");
    expect_refused(with(text, "kernels = ", "kernels = 0"), 8,
                   "stale: measured with other kernels or another compiler (there: 0");
}

TEST(Wisdom, RefusesWhatIsDamaged) {
    const std::string text = two_entries().export_text();
    const std::size_t last = line_of(text, "checksum = "), choice = line_of(text, "choice"),
                      figure = line_of(text, "figure"), body = line_of(text, "body = step two");
    std::string flipped = text;
    flipped[text.find("= 6.5") + 2] = '7';
    expect_refused(flipped, last, "damaged: the checksum does not fit what the file holds");
    expect_refused(text.substr(0, text.size() - 30), last - 1,
                   "damaged: the last line is not a checksum, so the file is cut short");
    expect_refused("", 1, "damaged: the key \"\" stands where \"schema\" must");
    expect_refused("rubbish\n", 1, "damaged: \"rubbish\" is not of the form key = value");
    expect_refused(with(text, "choice = flat-rows/sse2/fast/threads:1", "choice = flat-rows/sse2/fast/threads:0"),
                   choice, "damaged: the choice \"flat-rows/sse2/fast/threads:0\" is not of the form");
    expect_refused(with(text, "choice = flat-rows/sse2/fast/threads:1", "choice = flat-rows/sse2/fast/threads:7"),
                   choice, "damaged: the choice flat-rows/sse2/fast/threads:7 has no figure");
    expect_refused(with(text, "choice", "chance"), choice, "damaged: the key \"chance\" stands where \"choice\" must");
    expect_refused(with(text, "6.5 final", "-6.5 final"), figure, "damaged: the figure \"-6.5 final");
    expect_refused(with(text, "6.5 final", "nan final"), figure, "damaged: the figure \"nan final");
    expect_refused(with(text, "6.5 final", "6.5 fatal"), figure, "damaged: the figure \"6.5 fatal");
    expect_refused(with(text, "step two", "step one"), body, "damaged: a second entry for \"step one\"");
    expect_refused(with(text, "body = step two", "bo\x01y"), body, "damaged: \"bo?y\" is not of the form key = value");
}

TEST(Wisdom, AMissingFileIsNamed) {
    Wisdom wisdom;
    try {
        wisdom.import_file("/nonexistent/wisdom");
        ADD_FAILURE();
    } catch (const WisdomError& error) {
        EXPECT_STREQ(error.what(), "/nonexistent/wisdom: cannot be read: No such file or directory");
    }
    EXPECT_THROW(wisdom.import_file(::testing::TempDir()), WisdomError);
}

} // namespace
} // namespace hybmss
