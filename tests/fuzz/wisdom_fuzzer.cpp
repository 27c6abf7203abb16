// Wisdom: files as they come; and entries behind the head that this build on this machine writes, with a checksum that
// fits.

#include "hybmss/wisdom.hpp"
#include "plan/tuning/wisdom_store.hpp"
#include "tests/fuzz/fuzz_input.hpp"

#include <string>

using namespace hybmss;

namespace {

void read(std::string_view text) {
    Wisdom wisdom;
    try {
        wisdom.import_text(text, "wisdom");
    } catch (const WisdomError& error) {
        fuzz::require_one_line(error.what());
        fuzz::require(wisdom.entries() == 0, "refused wisdom left entries");
        return;
    }
    const std::string again = wisdom.export_text();
    Wisdom same;
    same.import_text(again, "wisdom");
    fuzz::require(same.export_text() == again, "the wisdom reads back as another");
}

/// Without its last line.
std::string head() {
    const std::string empty = Wisdom().export_text();
    return empty.substr(0, empty.rfind("checksum"));
}

} // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    static const std::string kHead = head();
    const std::string_view text = fuzz::text(data, size);
    read(text);
    const std::string whole = kHead + std::string(text) + (text.ends_with('\n') ? "" : "\n");
    read(whole + wisdom_checksum_line(whole));
    return 0;
}
