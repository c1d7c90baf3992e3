#include "bindings/columns.hpp"

#include <stdexcept>

namespace spook {

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
    if (rows_ == 0) return {{}, width};
    using Any = nb::ndarray<nb::ro, nb::c_contig, nb::device::cpu>;
    const Any array = nb::cast<Any>(column(name));
    if (array.ndim() != (width == 1 ? 1u : 2u) || array.size() != rows_ * width)
        refuse(name, "needs " + std::to_string(width) + " numbers a row");
    std::vector<double> values(rows_ * width);
    const auto copy = [&](const auto* from) {
        for (std::size_t i = 0; i < values.size(); ++i) values[i] = static_cast<double>(from[i]);
    };
    if (array.dtype() == nb::dtype<double>()) copy(static_cast<const double*>(array.data()));
    else if (array.dtype() == nb::dtype<std::int64_t>()) copy(static_cast<const std::int64_t*>(array.data()));
    else if (array.dtype() == nb::dtype<bool>()) copy(static_cast<const bool*>(array.data()));
    else refuse(name, "needs float64, int64 or bool");
    return {std::move(values), width};
}

std::vector<std::string> Columns::texts(const char* name) {
    if (rows_ == 0) return {};
    return nb::cast<std::vector<std::string>>(column(name));
}

}  // namespace spook
