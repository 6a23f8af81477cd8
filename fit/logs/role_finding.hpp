// Which column of a table measures what.
#pragma once

#include <string>
#include <vector>

#include "fit/logs/layout.hpp"
#include "fit/logs/table_shape.hpp"

namespace kphi::fit {

/// Gives `layout` its columns: as told, else by their names and units. Throws ConfigurationError
/// (path:line) where thrust or speed is missing or doubtful; what is left out is named in `layout.unread`.
void find_roles(const std::string& path, const std::vector<TextLine>& lines, const TableShape& shape,
                const std::vector<ColumnRole>& hints, Layout& layout);

}  // namespace kphi::fit
