#include "app/command_line.hpp"
#include "app/verify/verify.hpp"

#include <CLI/CLI.hpp>

#include <chrono>
#include <iostream>
#include <memory>

namespace {

struct VerifyArguments {
    std::string json, instruction_set = "all";
    bool quick = false, rows = false, force = false;
    unsigned seed = 1;
};

void run_verify(const VerifyArguments& arguments) {
    using namespace hybmss;
    verify::MatrixOptions options;
    options.extent = arguments.quick ? verify::Extent::quick : verify::Extent::full;
    options.seed = arguments.seed;
    if (arguments.instruction_set != "all") {
        options.instruction_sets = {resolve(parse_instruction_set(arguments.instruction_set))};
    }
    const auto json = open_output("--json", arguments.json, {"{\"version\":", {}, arguments.force});
    const auto start = std::chrono::steady_clock::now();
    const verify::RowTable table = verify::run_matrix(options);
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();

    (arguments.rows ? verify::print_table : verify::print_summary)(table, std::cout);
    std::cout << "seed " << options.seed << ", " << static_cast<long>(seconds + 0.5) << " s\n";
    if (json) {
        verify::write_json(table, options, seconds, json->stream());
        json->commit();
    }
    if (!verify::all_passed(table)) {
        throw CLI::RuntimeError(1);
    }
}

} // namespace

void add_verify_command(CLI::App& app) {
    const auto arguments = std::make_shared<VerifyArguments>();
    CLI::App* command = app.add_subcommand("verify", "compare every kernel of this machine with the scalar reference");
    command->add_option("--json", arguments->json, "also write the rows to this file")->check(hybmss::a_path());
    hybmss::add_force_option(*command, arguments->force);
    command
        ->add_option("--isa", arguments->instruction_set, "force one instruction set: sse2, avx2, avx512, neon; or all")
        ->capture_default_str();
    command->add_flag("--quick", arguments->quick, "leave out bodies of more than 1000 cells");
    command->add_flag("--rows", arguments->rows, "print every row of the matrix, not a line for each layout and type");
    command->add_option("--seed", arguments->seed, "of the random bodies and displacements")
        ->check(hybmss::a_seed())
        ->capture_default_str();
    command->callback([arguments] { run_verify(*arguments); });
}
