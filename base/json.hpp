// Members of a struct as values of a JSON object, under their own names.
#pragma once

#include <nlohmann/json.hpp>

/// json["name"] = object.name for each of the names, in their order.
#define KPHI_JSON_MEMBERS(json, object, ...)                                 \
  do {                                                                       \
    auto& nlohmann_json_j = json;                                            \
    const auto& nlohmann_json_t = object;                                    \
    NLOHMANN_JSON_EXPAND(NLOHMANN_JSON_PASTE(NLOHMANN_JSON_TO, __VA_ARGS__)) \
  } while (false)
