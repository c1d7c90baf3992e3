// A table of the scene as Python hands it over: columns by name, a row per body, joint, ….
#pragma once

#include <set>
#include <string>
#include <vector>

#include "bindings/common.hpp"

namespace spook {

/// How many there are of what an index counts, and what these are called; `world` says whether −1 is one, too.
struct Range {
    std::size_t count;
    const char* what;
    bool world = false;
};

/// One column: `width` numbers per row.
class Numbers {
public:
    Numbers(std::string name, std::vector<double> values, std::size_t width)
        : name_(std::move(name)), values_(std::move(values)), width_(width) {}

    double operator[](std::size_t row) const noexcept { return values_[row * width_]; }
    /// A whole number; one that is none is an error that names the column, and so is one outside of a range.
    int index(std::size_t row) const;
    int index(std::size_t row, const Range& range) const;
    /// 0 or 1; anything else is an error.
    bool flag(std::size_t row) const;
    const double* at(std::size_t row) const noexcept { return values_.data() + row * width_; }
    Vec3 vec(std::size_t row, std::size_t k = 0) const noexcept {
        const double* p = at(row) + 3 * k;
        return {p[0], p[1], p[2]};
    }
    Quat quat(std::size_t row) const noexcept { return {at(row)[0], at(row)[1], at(row)[2], at(row)[3]}; }

private:
    [[noreturn]] void refuse(const std::string& why) const;

    std::string name_;  // "joints: the column 'first'"
    std::vector<double> values_;
    std::size_t width_;
};

/// A dict every entry of which is read: one that is missing or, at the end, unread is an error that names it.
class Entries {
public:
    /// `called` is what an entry is called, as "method: the option".
    Entries(const nb::dict& entries, std::string called);

    nb::handle operator[](const char* name);
    /// An entry that is a dict itself; another is an error.
    nb::dict dict(const char* name);
    template <class T> void read(const char* name, T& value) { value = nb::cast<T>((*this)[name]); }
    template <class Enum> void read_kind(const char* name, Enum& value) {
        value = from_text<Enum>(nb::cast<std::string>((*this)[name]), name);
    }
    void expect_all_read() const;
    [[noreturn]] void refuse(const std::string& name, const std::string& why) const;

private:
    nb::dict entries_;
    std::string called_;
    std::set<std::string> unread_;
};

/// Reads the columns of one table of a scene, which are of one length. A table without columns has no rows.
class Columns {
public:
    Columns(Entries& scene, const char* table);

    std::size_t rows() const noexcept { return rows_; }
    void expect_all_read() const { columns_.expect_all_read(); }
    /// Numbers, whole or flags, of shape (rows,) or, for a width above 1, (rows, width).
    Numbers numbers(const char* name, std::size_t width = 1);
    std::vector<std::string> texts(const char* name);
    /// The members of an enumeration by their names.
    template <class Enum> std::vector<Enum> kinds(const char* name, const char* what) {
        std::vector<Enum> kinds;
        for (const std::string& text : texts(name)) kinds.push_back(from_text<Enum>(text, what));
        return kinds;
    }

private:
    Columns(const nb::dict& columns, std::string called);

    std::string called_;  // "joints: the column"
    Entries columns_;
    bool empty_;
    std::size_t rows_ = 0;
};

}  // namespace spook
