#include "simulation/geometry/gzip.hpp"

#include <algorithm>
#include <memory>
#include <new>
#include <stdexcept>

#include <zlib.h>

namespace hybmss {

std::string gunzip(std::string_view compressed, std::size_t at_most) {
    constexpr std::size_t kChunk = std::size_t{1} << 18;
    z_stream stream = {};
    if (inflateInit2(&stream, MAX_WBITS + 16) != Z_OK) { // + 16: gzip alone
        throw std::bad_alloc();
    }
    const std::unique_ptr<z_stream, int (*)(z_streamp)> owner(&stream, inflateEnd);
    std::string text;
    std::string chunk(kChunk, '\0');
    int status = Z_OK;
    while (text.size() <= at_most) {
        if (stream.avail_in == 0 && !compressed.empty()) {
            const std::string_view next = compressed.substr(0, std::size_t{1} << 30); // zlib counts in 32 bits
            // zlib never writes there; its interface is older than const.
            stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(next.data()));
            stream.avail_in = static_cast<uInt>(next.size());
            compressed.remove_prefix(next.size());
        }
        if (status == Z_STREAM_END) {
            if (stream.avail_in == 0) {
                return text;
            }
            inflateReset(&stream); // one more member
        }
        stream.next_out = reinterpret_cast<Bytef*>(chunk.data());
        stream.avail_out = static_cast<uInt>(chunk.size());
        status = inflate(&stream, Z_NO_FLUSH);
        text.append(chunk, 0, chunk.size() - stream.avail_out);
        if (status == Z_BUF_ERROR) {
            throw std::runtime_error("its gzip stream is cut short");
        }
        if (status != Z_OK && status != Z_STREAM_END) {
            throw std::runtime_error(std::string("its gzip stream is damaged: ") +
                                     (stream.msg ? stream.msg : "no data"));
        }
    }
    return text;
}

} // namespace hybmss
