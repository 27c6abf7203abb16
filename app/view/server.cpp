#include "app/view/server.hpp"

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>

#include <array>
#include <deque>
#include <optional>
#include <set>
#include <stdexcept>
#include <unistd.h>
#include <utility>

namespace hybmss {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using tcp = asio::ip::tcp;
using Failure = beast::error_code;
using SharedMessage = std::shared_ptr<const ViewServer::Message>;

constexpr std::size_t kMostConnections = 32, kMostHeaderBytes = 8192, kMostMessageBytes = 256;
constexpr std::chrono::seconds kPatience(10);

/// 128 random bits as hexadecimal digits.
std::string random_word() {
    std::array<unsigned char, 16> bytes{};
    if (getentropy(bytes.data(), bytes.size()) != 0) {
        throw std::runtime_error("the system gives no random numbers");
    }
    std::string word;
    for (const unsigned char byte : bytes) {
        word += "0123456789abcdef"[byte >> 4];
        word += "0123456789abcdef"[byte & 15];
    }
    return word;
}

/// In a time that does not tell where they differ.
bool equal(std::string_view a, std::string_view b) {
    unsigned different = a.size() != b.size();
    for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i) {
        different |= static_cast<unsigned>(a[i] ^ b[i]);
    }
    return different == 0;
}

} // namespace

struct ViewServer::Implementation {
    class Connection;

    std::string page, token = random_word();
    Events events;
    unsigned short port = 0;
    std::size_t connections = 0;
    std::set<Connection*> viewers; ///< those with a stream
    // Connections live in the context's handlers, and end with it: before what they refer to.
    asio::io_context context{1};
    tcp::acceptor acceptor{context};
    asio::steady_timer pause{context};

    void accept();
    std::string authority() const { return "127.0.0.1:" + std::to_string(port); }
    bool is_here(std::string_view host) const {
        return host == authority() || host == "localhost:" + std::to_string(port);
    }
};

/// One request, or one stream.
class ViewServer::Implementation::Connection : public std::enable_shared_from_this<Connection> {
public:
    Connection(Implementation& server, tcp::socket socket) : server_(server), stream_(std::move(socket)) {
        ++server_.connections;
        parser_.header_limit(kMostHeaderBytes);
        parser_.body_limit(0);
    }
    Connection(const Connection&) = delete;
    Connection& operator=(const Connection&) = delete;
    ~Connection() { --server_.connections; }

    void begin() {
        beast::get_lowest_layer(stream_).expires_after(kPatience);
        http::async_read(beast::get_lowest_layer(stream_), buffer_, parser_,
                         [self = shared_from_this()](Failure failure, std::size_t) {
                             if (!failure) {
                                 self->answer();
                             }
                         });
    }
    void send(const SharedMessage& message) {
        // The first of the queue is on its way.
        if (message->replaceable && queue_.size() > 1 && queue_.back()->replaceable) {
            queue_.back() = message;
            return;
        }
        queue_.push_back(message);
        if (queue_.size() == 1) {
            write();
        }
    }
    bool idle() const { return queue_.empty(); }

private:
    void answer() {
        const auto& request = parser_.get();
        const std::string_view target(request.target().data(), request.target().size());
        const std::string root = "/" + server_.token + "/";
        const bool for_page = equal(target, root), for_stream = equal(target, root + "stream");
        if (!is_welcome(request)) {
            respond(http::status::forbidden, "this host or origin is refused\n");
        } else if (!for_page && !for_stream) {
            respond(http::status::not_found, "there is nothing here; the address that hybmss printed is needed\n");
        } else if (request.method() != http::verb::get) {
            respond(http::status::method_not_allowed, "GET alone is answered\n");
        } else if (for_page) {
            respond(http::status::ok, server_.page);
        } else if (websocket::is_upgrade(request)) {
            open_stream();
        } else {
            respond(http::status::upgrade_required, "this is a websocket\n");
        }
    }
    /// Another site's name may lead to this machine (DNS rebinding), and any page may ask: both show in the header.
    bool is_welcome(const http::request<http::empty_body>& request) const {
        const auto text = [](auto field) { return std::string_view(field.data(), field.size()); };
        constexpr std::string_view kScheme = "http://";
        const std::string_view origin = text(request[http::field::origin]);
        return request.count(http::field::host) == 1 && server_.is_here(text(request[http::field::host])) &&
               request.count(http::field::origin) <= 1 &&
               (request.count(http::field::origin) == 0 ||
                (origin.starts_with(kScheme) && server_.is_here(origin.substr(kScheme.size()))));
    }
    void respond(http::status status, std::string text) {
        response_.result(status);
        const bool good = status == http::status::ok;
        const std::string nonce = random_word();
        constexpr std::string_view kMark = "@NONCE@";
        for (std::size_t at = text.find(kMark); good && at != std::string::npos; at = text.find(kMark)) {
            text.replace(at, kMark.size(), nonce);
        }
        response_.set(http::field::content_type, good ? "text/html; charset=utf-8" : "text/plain; charset=utf-8");
        response_.set(http::field::cache_control, "no-store");
        response_.set("X-Content-Type-Options", "nosniff");
        response_.set("X-Frame-Options", "DENY");
        response_.set("Referrer-Policy", "no-referrer");
        const std::string here = std::to_string(server_.port);
        response_.set("Content-Security-Policy",
                      "default-src 'none'; script-src 'nonce-" + nonce + "'; style-src 'nonce-" + nonce +
                          "'; connect-src ws://127.0.0.1:" + here + " ws://localhost:" + here +
                          "; base-uri 'none'; form-action 'none'; frame-ancestors 'none'");
        response_.keep_alive(false);
        response_.body() = std::move(text);
        response_.prepare_payload();
        http::async_write(
            beast::get_lowest_layer(stream_), response_, [self = shared_from_this()](Failure, std::size_t) {
                Failure ignored;
                beast::get_lowest_layer(self->stream_).socket().shutdown(tcp::socket::shutdown_send, ignored);
            });
    }

    void open_stream() {
        beast::get_lowest_layer(stream_).expires_never(); // the websocket has times of its own
        stream_.set_option(websocket::stream_base::timeout::suggested(beast::role_type::server));
        stream_.read_message_max(kMostMessageBytes);
        stream_.async_accept(parser_.get(), [self = shared_from_this()](Failure failure) {
            if (!failure) {
                self->server_.viewers.insert(self.get());
                for (Message& message : self->server_.events.joined()) {
                    self->send(std::make_shared<const Message>(std::move(message)));
                }
                self->read();
            }
        });
    }
    void read() {
        stream_.async_read(buffer_, [self = shared_from_this()](Failure failure, std::size_t) {
            if (failure) {
                self->leave();
                return;
            }
            const std::string text = beast::buffers_to_string(self->buffer_.data());
            self->buffer_.consume(self->buffer_.size());
            if (self->stream_.got_text() && self->server_.events.received(text)) {
                self->read();
                return;
            }
            self->leave();
            self->stream_.async_close({websocket::close_code::policy_error, "no such message"}, [self](Failure) {});
        });
    }
    void write() {
        stream_.binary(queue_.front()->binary);
        stream_.async_write(asio::buffer(queue_.front()->bytes),
                            [self = shared_from_this()](Failure failure, std::size_t) {
                                if (failure) {
                                    self->queue_.clear();
                                    self->leave();
                                    return;
                                }
                                self->queue_.pop_front();
                                if (!self->queue_.empty() && self->server_.viewers.contains(self.get())) {
                                    self->write();
                                }
                            });
    }
    void leave() {
        if (server_.viewers.erase(this) > 0) {
            server_.events.left();
        }
    }

    Implementation& server_;
    websocket::stream<beast::tcp_stream> stream_;
    beast::flat_buffer buffer_{kMostHeaderBytes};
    http::request_parser<http::empty_body> parser_;
    http::response<http::string_body> response_;
    std::deque<SharedMessage> queue_;
};

void ViewServer::Implementation::accept() {
    acceptor.async_accept([this](Failure failure, tcp::socket socket) {
        if (failure) { // perhaps no descriptor is left
            pause.expires_after(std::chrono::milliseconds(100));
            pause.async_wait([this](Failure ended) {
                if (!ended) {
                    accept();
                }
            });
            return;
        }
        if (connections < kMostConnections) {
            std::make_shared<Connection>(*this, std::move(socket))->begin();
        }
        accept();
    });
}

ViewServer::ViewServer(int port, std::string page, Events events) : implementation_(new Implementation) {
    Implementation& server = *implementation_;
    server.page = std::move(page);
    server.events = std::move(events);
    try {
        const tcp::endpoint here(asio::ip::address_v4::loopback(), static_cast<unsigned short>(port));
        server.acceptor.open(here.protocol());
        server.acceptor.set_option(tcp::acceptor::reuse_address(true));
        server.acceptor.bind(here);
        server.acceptor.listen();
        server.port = server.acceptor.local_endpoint().port();
    } catch (const boost::system::system_error& error) {
        throw std::runtime_error("port " + std::to_string(port) + " of 127.0.0.1: " + error.code().message());
    }
    server.accept();
}

ViewServer::~ViewServer() = default;

std::string ViewServer::address() const {
    return "http://" + implementation_->authority() + "/" + implementation_->token + "/";
}

std::size_t ViewServer::viewers() const {
    return implementation_->viewers.size();
}

bool ViewServer::idle() const {
    for (const Implementation::Connection* viewer : implementation_->viewers) {
        if (!viewer->idle()) {
            return false;
        }
    }
    return true;
}

void ViewServer::send(Message message) {
    const auto shared = std::make_shared<const Message>(std::move(message));
    for (Implementation::Connection* viewer : implementation_->viewers) {
        viewer->send(shared);
    }
}

void ViewServer::poll(std::chrono::milliseconds wait) {
    implementation_->context.restart();
    implementation_->context.run_one_for(wait);
    implementation_->context.poll();
}

} // namespace hybmss
