#include "bindings/columns.hpp"

#include <cmath>
#include <cstdio>
#include <limits>
#include <stdexcept>

namespace spook {

namespace {

std::string shortest(double value) {
    char text[32];
    std::snprintf(text, sizeof text, "%g", value);
    return text;
}

}  // namespace

void Numbers::refuse(const std::string& why) const { throw std::invalid_argument(name_ + " " + why); }

int Numbers::index(std::size_t row) const {
    const double value = values_[row * width_];
    constexpr double most = std::numeric_limits<int>::max();
    if (!(std::abs(value) <= most) || value != std::trunc(value))
        refuse("needs whole numbers, not " + shortest(value));
    return static_cast<int>(value);
}

int Numbers::index(std::size_t row, const Range& range) const {
    const int value = index(row);
    if (value < (range.world ? -1 : 0) || value >= static_cast<int>(range.count))
        refuse("has " + std::to_string(value) + ", and there are " + std::to_string(range.count) + " " +
               range.what);
    return value;
}

bool Numbers::flag(std::size_t row) const {
    const double value = values_[row * width_];
    if (value != 0.0 && value != 1.0) refuse("needs 0 or 1, not " + shortest(value));
    return value == 1.0;
}

Columns::Columns(const nb::dict& columns, const char* table) : columns_(columns), table_(table) {
    for (const auto& [name, values] : columns) {
        unread_.insert(nb::cast<std::string>(name));
        rows_ = nb::len(values);
    }
    for (const auto& [name, values] : columns)
        if (nb::len(values) != rows_)
            refuse(nb::cast<std::string>(name).c_str(), "differs in length from the others");
}

void Columns::expect_all_read() const {
    if (!unread_.empty()) refuse(unread_.begin()->c_str(), "means nothing here");
}

void Columns::refuse(const char* name, const std::string& why) const {
    throw std::invalid_argument(table_ + ": the column '" + name + "' " + why);
}

nb::handle Columns::column(const char* name) {
    if (!columns_.contains(name)) refuse(name, "is missing");
    unread_.erase(name);
    return columns_[name];
}

Numbers Columns::numbers(const char* name, std::size_t width) {
    if (nb::len(columns_) == 0) return {"", {}, width};
    using Any = nb::ndarray<nb::ro, nb::c_contig, nb::device::cpu>;
    const Any array = nb::cast<Any>(column(name));
    if (rows_ > 0 && (array.ndim() != (width == 1 ? 1u : 2u) || array.size() != rows_ * width))
        refuse(name, "needs " + std::to_string(width) + " numbers a row");
    std::vector<double> values(rows_ * width);
    const auto copy = [&](const auto* from) {
        for (std::size_t i = 0; i < values.size(); ++i) values[i] = static_cast<double>(from[i]);
    };
    if (array.dtype() == nb::dtype<double>()) copy(static_cast<const double*>(array.data()));
    else if (array.dtype() == nb::dtype<std::int64_t>()) copy(static_cast<const std::int64_t*>(array.data()));
    else if (array.dtype() == nb::dtype<bool>()) copy(static_cast<const bool*>(array.data()));
    else refuse(name, "needs float64, int64 or bool");
    return {table_ + ": the column '" + name + "'", std::move(values), width};
}

std::vector<std::string> Columns::texts(const char* name) {
    if (nb::len(columns_) == 0) return {};
    return nb::cast<std::vector<std::string>>(column(name));
}

}  // namespace spook
