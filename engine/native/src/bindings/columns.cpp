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

Entries::Entries(const nb::dict& entries, std::string called)
    : entries_(entries), called_(std::move(called)) {
    for (const auto& [name, value] : entries) unread_.insert(nb::cast<std::string>(name));
}

nb::handle Entries::operator[](const char* name) {
    if (!entries_.contains(name)) refuse(name, "is missing");
    unread_.erase(name);
    return entries_[name];
}

nb::dict Entries::dict(const char* name) {
    const nb::handle entry = (*this)[name];
    if (!nb::isinstance<nb::dict>(entry)) refuse(name, "is no dict");
    return nb::borrow<nb::dict>(entry);
}

void Entries::expect_all_read() const {
    if (!unread_.empty()) refuse(*unread_.begin(), "means nothing here");
}

void Entries::refuse(const std::string& name, const std::string& why) const {
    throw std::invalid_argument(called_ + " '" + name + "' " + why);
}

Columns::Columns(Entries& scene, const char* table)
    : Columns(scene.dict(table), std::string(table) + ": the column") {}

Columns::Columns(const nb::dict& columns, std::string called)
    : called_(std::move(called)), columns_(columns, called_), empty_(nb::len(columns) == 0) {
    for (const auto& [name, values] : columns) rows_ = nb::len(values);
    for (const auto& [name, values] : columns)
        if (nb::len(values) != rows_)
            columns_.refuse(nb::cast<std::string>(name), "differs in length from the others");
}

Numbers Columns::numbers(const char* name, std::size_t width) {
    if (empty_) return {"", {}, width};
    using Any = nb::ndarray<nb::ro, nb::c_contig, nb::device::cpu>;
    const Any array = nb::cast<Any>(columns_[name]);
    if (rows_ > 0 && (array.ndim() != (width == 1 ? 1u : 2u) || array.size() != rows_ * width))
        columns_.refuse(name, "needs " + std::to_string(width) + " numbers a row");
    std::vector<double> values(rows_ * width);
    const auto copy = [&](const auto* from) {
        for (std::size_t i = 0; i < values.size(); ++i) values[i] = static_cast<double>(from[i]);
    };
    if (array.dtype() == nb::dtype<double>()) copy(static_cast<const double*>(array.data()));
    else if (array.dtype() == nb::dtype<std::int64_t>()) copy(static_cast<const std::int64_t*>(array.data()));
    else if (array.dtype() == nb::dtype<bool>()) copy(static_cast<const bool*>(array.data()));
    else columns_.refuse(name, "needs float64, int64 or bool");
    return {called_ + " '" + name + "'", std::move(values), width};
}

std::vector<std::string> Columns::texts(const char* name) {
    if (empty_) return {};
    return nb::cast<std::vector<std::string>>(columns_[name]);
}

}  // namespace spook
