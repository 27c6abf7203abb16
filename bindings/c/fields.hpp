#pragma once

#include "hybmss/hybmss.h"
#include "hybmss/vector_field.hpp"

#include <cstddef>
#include <mutex>
#include <utility>
#include <vector>

namespace hybmss::c_interface {

/// Throw std::invalid_argument with the field's name unless it is a field of `nodes` nodes of this precision. A map is
/// looked at from end to end.
template <class T>
void check(const hybmss_const_field* field, std::size_t nodes, const char* name);
template <class T>
void check(const hybmss_field* field, std::size_t nodes, const char* name);

/// Throws where a component of `out` begins where one of `in` does. What else they may share, the plan looks at.
void check_apart(const hybmss_const_field& in, const hybmss_field& out, const char* name);

/// Arrays for fields in another order than the body's: an execution takes what it needs and gives it back.
template <class T>
class Scratch {
public:
    std::vector<T> take(std::size_t size) {
        std::vector<T> array;
        {
            const std::lock_guard lock(mutex_);
            if (!idle_.empty()) {
                array = std::move(idle_.back());
                idle_.pop_back();
            }
        }
        array.resize(size);
        return array;
    }
    void give_back(std::vector<T> array) noexcept {
        try {
            const std::lock_guard lock(mutex_);
            idle_.push_back(std::move(array));
        } catch (...) {
            // No memory to remember it: it goes.
        }
    }

private:
    std::mutex mutex_;
    std::vector<std::vector<T>> idle_;
};

/// A field to read, in the body's order: the caller's memory, or a copy where there is a map.
template <class T>
class Input {
public:
    /// The field has been checked.
    Input(const hybmss_const_field& field, std::size_t nodes, Scratch<T>& scratch);
    ~Input() {
        if (!copy_.empty()) {
            scratch_.give_back(std::move(copy_));
        }
    }
    Input(const Input&) = delete;
    Input& operator=(const Input&) = delete;
    const VectorField<const T>& view() const { return view_; }

private:
    Scratch<T>& scratch_;
    std::vector<T> copy_;
    VectorField<const T> view_;
};

/// A field to write, in the body's order: the caller's memory, or zeros that are brought there in the end.
template <class T>
class Output {
public:
    /// The field has been checked.
    Output(const hybmss_field& field, std::size_t nodes, Scratch<T>& scratch);
    ~Output() {
        if (!copy_.empty()) {
            scratch_.give_back(std::move(copy_));
        }
    }
    Output(const Output&) = delete;
    Output& operator=(const Output&) = delete;
    const VectorField<T>& view() const { return view_; }
    /// Where there is a map: caller's entry = (or +=) value of the node.
    void set() const;
    void add() const;

private:
    template <class Move>
    void bring(const Move& move) const;

    const hybmss_field& field_;
    Scratch<T>& scratch_;
    std::vector<T> copy_;
    VectorField<T> view_;
};

} // namespace hybmss::c_interface
