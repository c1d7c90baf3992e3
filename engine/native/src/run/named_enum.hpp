// Enumerations whose members have names as text, each written once: SPOOK_NAMED_ENUM(Colour, red, green).
// With -Werror=switch a switch over one without a `default` cannot forget a member.
#pragma once

#include <cstddef>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace spook {

/// "red, green" → {"red", "green"}.
inline std::vector<std::string> names_in(std::string_view list) {
    std::vector<std::string> names;
    while (!list.empty()) {
        const std::size_t comma = std::min(list.find(','), list.size());
        std::string_view name = list.substr(0, comma);
        while (!name.empty() && name.front() == ' ') name.remove_prefix(1);
        names.emplace_back(name);
        list.remove_prefix(std::min(comma + 1, list.size()));
    }
    return names;
}

#define SPOOK_NAMED_ENUM(Enum, ...)                                           \
    enum class Enum : unsigned char { __VA_ARGS__ };                          \
    inline const std::vector<std::string>& names_of(Enum) {                   \
        static const std::vector<std::string> names = names_in(#__VA_ARGS__); \
        return names;                                                         \
    }

template <class Enum> const std::string& to_text(Enum member) {
    return names_of(Enum{})[static_cast<std::size_t>(member)];
}

/// The member of that name; `what` says in the error what it was to be. Throws std::invalid_argument.
template <class Enum> Enum from_text(const std::string& text, const char* what) {
    const std::vector<std::string>& names = names_of(Enum{});
    for (std::size_t k = 0; k < names.size(); ++k)
        if (names[k] == text) return static_cast<Enum>(k);
    std::string known;
    for (const std::string& name : names) known += (known.empty() ? "" : ", ") + name;
    throw std::invalid_argument("there is no " + std::string(what) + " '" + text + "'; there are " + known);
}

}  // namespace spook
