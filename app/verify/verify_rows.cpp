#include "app/verify/verify_rows.hpp"

#include "app/verify/verify_tolerances.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace hybmss::verify {

void RowTable::record(const RowKey& key, double error, const std::string& body) {
    auto row = std::find_if(rows_.begin(), rows_.end(), [&](const Row& r) { return r.key == key; });
    if (row == rows_.end()) {
        row = rows_.insert(rows_.end(), Row{key, 0, 0, tolerance(key), ""});
    }
    const double bounded = std::isnan(error) ? std::numeric_limits<double>::infinity() : error;
    if (row->cases == 0 || bounded > row->error) {
        row->error = bounded;
        row->worst_body = body;
    }
    ++row->cases;
}

double epsilon(const std::string& precision) {
    return precision == "float" ? static_cast<double>(std::numeric_limits<float>::epsilon())
                                : std::numeric_limits<double>::epsilon();
}

} // namespace hybmss::verify
