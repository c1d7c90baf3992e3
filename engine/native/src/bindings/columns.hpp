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

/// Reads the columns of one table; a column that is missing, of another shape or, at the end, unread is an error
/// that names it. A table without columns has no rows.
class Columns {
public:
    Columns(const nb::dict& columns, const char* table);

    std::size_t rows() const noexcept { return rows_; }
    void expect_all_read() const;
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
    nb::handle column(const char* name);
    [[noreturn]] void refuse(const char* name, const std::string& why) const;

    nb::dict columns_;
    std::string table_;
    std::set<std::string> unread_;
    std::size_t rows_ = 0;
};

}  // namespace spook
