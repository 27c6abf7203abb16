#include "studies/paper/figures.hpp"
#include "studies/paper/tables.hpp"

#include <fmt/format.h>

namespace hybmss::paper {
namespace {

constexpr double kPoissonRatios[] = {0, 0.25, 0.499};

struct Heading {
    const char* name;
    const char* title;
    const char* unit;     ///< of what the paper prints
    const char* response; ///< that it does not print; nullptr where it is the same
};

Heading heading(Kind kind) {
    switch (kind) {
    case Kind::compression:
        return {"compression", "Table 2: compression", "e %", "N"};
    case Kind::tension:
        return {"tension", "Table 3: tension", "e %", "N"};
    case Kind::shear:
        return {"shear", "Table 4: shear", "N", nullptr};
    default:
        return {"torsion", "Table 5: torsion", "N m", nullptr};
    }
}

std::vector<std::string> introduction(Kind kind) {
    const char* body = kind == Kind::tension ? "A bar of 0.4 x 0.4 x 2.4 m in 4 x 4 x 24 cells"
                                             : "A cube of 5 m in 10 x 10 x 10 cells";
    std::string text = fmt::format("{} between clamped plates, E = 10 kPa. ", body);
    text += kind == Kind::compression || kind == Kind::tension
                ? "e is the relative change of volume, N the force on the plate."
                : "The figure is what the moved plate exerts.";
    if (kind == Kind::torsion) {
        text += " The print says \"5 %\" and \"20 %\" and no angle; 1 degree and 45 degrees come nearest.";
    }
    return {text};
}

Cell cell(std::optional<double> value) {
    return value ? Cell(*value) : Cell();
}

/// Young's modulus and Poisson's ratio with the same G and four times kappa = G (4 nu - 1) / (1 - 2 nu).
Material with_fourfold_volume_modulus(Material material) {
    const double G = shear_modulus(material), r = 4 * volume_modulus(material) / G;
    material.poisson_ratio = (1 + r) / (4 + 2 * r);
    material.young_modulus = 2 * G * (1 + material.poisson_ratio);
    return material;
}

/// A row beside the paper's models.
struct Variant {
    std::string name;
    Material material;
};

std::vector<Variant> variants(const Experiment& experiment) {
    Material material = scene(experiment).material;
    if (experiment.poisson_ratio < 0.25) {
        material.volume_energy = VolumeEnergy::quadratic;
        return {{"(J - 1)^2", material}};
    }
    if (experiment.poisson_ratio > 0.25) {
        return {{"4 kappa", with_fourfold_volume_modulus(material)}};
    }
    return {};
}

class PlateRows {
public:
    PlateRows(Kind kind, TableContext& context, Table& table)
        : context_(context), table_(table), response_too_(heading(kind).response != nullptr) {}

    void add(const Experiment& experiment) {
        const PrintedFigures printed = printed_figures(experiment);
        const Figures& calculix = context_.finite_elements.figures(experiment);
        const Figures& neo_hooke = context_.finite_elements.figures(
            experiment, {.geometry = calculix::Geometry::nonlinear, .law = calculix::Law::neo_hooke});
        const auto row = [&](const std::string& model, std::optional<double> paper, std::optional<double> fem,
                             const Figures& ours, const std::string& remark) {
            std::vector<Cell> cells = {amount_text(experiment), fmt::format("{:g}", experiment.poisson_ratio), model,
                                       cell(paper), cell(fem)};
            for (const Figures* figures : {&ours, &calculix, &neo_hooke}) {
                cells.push_back(figures->good() ? Cell(printed_quantity(experiment, *figures)) : Cell());
            }
            if (response_too_) {
                cells.push_back(ours.good() ? Cell(ours.response) : Cell());
                cells.push_back(calculix.good() ? Cell(calculix.response) : Cell());
            }
            cells.push_back(remark);
            table_.rows.push_back(std::move(cells));
        };
        for (const Model model : kModels) {
            context_.progress(key(experiment) + " " + std::string(name(model)));
            const Figures ours = solve_lattice(experiment, model);
            Difference differs = difference(experiment, model, printed.of(model), ours);
            if (model == Model::hybmss) {
                compare_finite_elements(experiment, printed.finite_elements, calculix, differs);
            }
            reasons_.insert(differs.reasons.begin(), differs.reasons.end());
            row(std::string(name(model)), printed.of(model), printed.finite_elements, ours, differs.text());
        }
        for (const Variant& variant : variants(experiment)) {
            context_.progress(key(experiment) + " " + variant.name);
            const Figures ours = solve_lattice(experiment, variant.material);
            row(variant.name, std::nullopt, std::nullopt, ours, ours.good() ? "" : "no equilibrium");
        }
    }

    const std::set<Reason>& reasons() const { return reasons_; }

private:
    TableContext& context_;
    Table& table_;
    bool response_too_;
    std::set<Reason> reasons_;
};

} // namespace

Table plate_table(Kind kind, TableContext& context) {
    const Heading words = heading(kind);
    const int decimals = words.response ? 3 : 1;
    const auto with_unit = [&](const char* what) { return fmt::format("{}, {}", what, words.unit); };
    Table table{words.name,
                words.title,
                introduction(kind),
                {{"amount", "amount"},
                 {"poisson_ratio", "nu"},
                 {"model", "model"},
                 {"paper_hybmss", with_unit("paper"), words.response ? 2 : 0},
                 {"paper_fem", with_unit("paper FEM"), words.response ? 2 : 0},
                 {"ours", with_unit("ours"), decimals},
                 {"calculix", with_unit("CalculiX"), decimals},
                 {"calculix_neo_hooke", "neo-Hooke", decimals}},
                {},
                {}};
    if (words.response) {
        table.columns.push_back({"ours_force", fmt::format("ours, {}", words.response), 1});
        table.columns.push_back({"calculix_force", fmt::format("CalculiX, {}", words.response), 1});
    }
    table.columns.push_back({"against_print", "against print"});
    PlateRows rows(kind, context, table);
    for (const double amount : kind == Kind::torsion ? std::vector<double>{1, 45} : std::vector<double>{5, 20}) {
        for (const double nu : kPoissonRatios) {
            rows.add({.kind = kind, .amount = amount, .poisson_ratio = nu});
        }
    }
    table.remarks = explanations(rows.reasons());
    return table;
}

Table layer_table(TableContext& context) {
    Table table{
        "layers",
        "Fig. 8 and 10: distance of the middle layer from finite elements",
        {"The mean distance between the nodes of the middle layer (shear: z = 2.5 m, 20 %; torsion: y = 2.5 m, 45 "
         "degrees) of the lattice and of finite elements on the same mesh: of LS-DYNA in the print, of CalculiX "
         "here. The cube's edge is 5 m."},
        {{"experiment", "experiment"},
         {"poisson_ratio", "nu"},
         {"model", "model"},
         {"paper_hybmss", "paper, m", 3},
         {"ours", "to CalculiX, m", 4},
         {"ours_neo_hooke", "to neo-Hooke, m", 4},
         {"calculix", "CalculiX to neo-Hooke, m", 4}},
        {},
        {"Two finite element laws (last column) lie as far from each other as the lattice from either: this distance "
         "tells laws apart, not the right model from the wrong.",
         "At nu = 0.499 St Venant and Kirchhoff do not keep the volume (see Table 2); HybMSS and neo-Hooke do.",
         "HybMSS lies nearer to CalculiX than the print to LS-DYNA in most rows: the print compares a motion "
         "after 10 s, and with another law.",
         "Without face diagonals (HybMSS-FD, HybMSS-M) there is no equilibrium at nu = 0 under 45 degrees."}};
    for (const Kind kind : {Kind::shear, Kind::torsion}) {
        for (const double nu : {0.0, 0.25, 0.499}) {
            const Experiment experiment{
                .kind = kind, .amount = kind == Kind::torsion ? 45.0 : 20.0, .poisson_ratio = nu};
            const Figures& calculix = context.finite_elements.figures(experiment);
            const Figures& neo_hooke = context.finite_elements.figures(
                experiment, {.geometry = calculix::Geometry::nonlinear, .law = calculix::Law::neo_hooke});
            const auto distance = [](const Figures& a, const Figures& b) {
                return a.good() && b.good() ? Cell(mean_distance(a, b)) : Cell();
            };
            for (const Model model : kModels) {
                context.progress(key(experiment) + " " + std::string(name(model)));
                const Figures ours = solve_lattice(experiment, model);
                const auto printed = model == Model::hybmss ? printed_distance(experiment) : std::nullopt;
                table.rows.push_back({std::string(name(kind)), fmt::format("{:g}", nu), std::string(name(model)),
                                      printed ? Cell(*printed) : Cell(), distance(ours, calculix),
                                      distance(ours, neo_hooke), distance(calculix, neo_hooke)});
            }
        }
    }
    return table;
}

} // namespace hybmss::paper
