#pragma once

/// \file
/// A page and a stream of messages for browsers on this machine. Knows nothing of bodies.

#include <chrono>
#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace hybmss {

/// Listens on 127.0.0.1 alone. What it answers, it answers to requests for http://127.0.0.1:PORT/TOKEN/ (the page) and
/// /TOKEN/stream (a websocket): the token is random, so that other users of the machine and pages of other sites do not
/// know it; the request's Host must be this machine, and its Origin, where it has one, the page itself. No path leads
/// to a file. One thread: everything happens within poll().
class ViewServer {
public:
    struct Message {
        std::string bytes;
        bool binary = false;
        bool replaceable = false; ///< by the next such one, where a viewer has not taken it yet
    };
    struct Events {
        /// What a viewer is told first.
        std::function<std::vector<Message>()> joined;
        std::function<void()> left;
        /// Of at most 256 bytes; false: no such message, and the connection ends.
        std::function<bool(std::string_view)> received;
    };

    /// `port`: 0 for any that is free. Of the page every "@NONCE@" becomes a word that its scripts are let in by.
    /// Throws std::runtime_error where the port cannot be had.
    ViewServer(int port, std::string page, Events events);
    ViewServer(const ViewServer&) = delete;
    ViewServer& operator=(const ViewServer&) = delete;
    ~ViewServer();

    /// http://127.0.0.1:PORT/TOKEN/
    std::string address() const;
    std::size_t viewers() const;
    /// Whether every viewer has taken what was sent.
    bool idle() const;
    /// To all viewers.
    void send(Message message);
    /// Handles what has come, and waits for the first of it, so long at most.
    void poll(std::chrono::milliseconds wait);

private:
    struct Implementation;
    std::unique_ptr<Implementation> implementation_;
};

} // namespace hybmss
