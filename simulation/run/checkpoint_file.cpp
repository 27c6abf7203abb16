#include "simulation/run/checkpoint_file.hpp"

#include "layouts/read_file.hpp"
#include "plan/tuning/digest.hpp"
#include "simulation/results/atomic_file.hpp"

#include <ostream>
#include <string_view>

namespace hybmss {
namespace {

// magic | number of sections | for each: length of name, name, length, bytes | digest of all that
// Integers are 64 bits in the machine's order: on one of the other order the number of sections is absurd.
constexpr std::string_view kMagic = "hybmss checkpoint 1\n";

class Writer {
public:
    explicit Writer(std::ostream& out) : out_(out) {}
    void write(std::string_view bytes) {
        digest_.add(bytes);
        out_.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    }
    void write(std::uint64_t number) { write({reinterpret_cast<const char*>(&number), sizeof number}); }
    std::uint64_t digest() const { return digest_.value(); }

private:
    std::ostream& out_;
    Digest digest_;
};

class Reader {
public:
    explicit Reader(std::string_view rest) : rest_(rest) {}
    std::string_view bytes(std::uint64_t count) {
        if (count > rest_.size()) {
            throw std::runtime_error("it is cut short or damaged");
        }
        const std::string_view taken = rest_.substr(0, static_cast<std::size_t>(count));
        rest_.remove_prefix(taken.size());
        return taken;
    }
    std::uint64_t number() {
        std::uint64_t value = 0;
        std::memcpy(&value, bytes(sizeof value).data(), sizeof value);
        return value;
    }

private:
    std::string_view rest_;
};

} // namespace

const std::string& CheckpointSections::text(const std::string& name) const {
    const auto found = sections_.find(name);
    if (found == sections_.end()) {
        throw std::runtime_error("it has no section \"" + name + "\"");
    }
    return found->second;
}

void write_checkpoint_file(const std::filesystem::path& path, const CheckpointSections& sections) {
    AtomicFile file(path);
    Writer writer(file.stream());
    writer.write(kMagic);
    writer.write(sections.all().size());
    for (const auto& [name, bytes] : sections.all()) {
        writer.write(name.size());
        writer.write(name);
        writer.write(bytes.size());
        writer.write(bytes);
    }
    writer.write(writer.digest());
    file.commit();
}

CheckpointSections read_checkpoint_file(const std::filesystem::path& path) {
    constexpr std::uintmax_t kMostBytes = 200'000'000'000; // 1e9 nodes take less
    const std::string content = read_file(path, Readable::regular_file, kMostBytes);
    if (!content.starts_with(kMagic.substr(0, content.size()))) {
        throw std::runtime_error("it is no checkpoint of hybmss, or one of another format");
    }
    std::uint64_t digest = 0;
    if (content.size() < kMagic.size() + sizeof digest) {
        throw std::runtime_error("it is cut short or damaged");
    }
    const std::string_view body(content.data(), content.size() - sizeof digest);
    std::memcpy(&digest, content.data() + body.size(), sizeof digest);
    Digest found;
    found.add(body);
    if (found.value() != digest) {
        throw std::runtime_error("it is cut short or damaged: its bytes do not match its digest");
    }
    Reader reader(body.substr(kMagic.size()));
    CheckpointSections sections;
    for (std::uint64_t left = reader.number(); left > 0; --left) {
        std::string name(reader.bytes(reader.number()));
        sections.put(name, std::string(reader.bytes(reader.number())));
    }
    return sections;
}

} // namespace hybmss
