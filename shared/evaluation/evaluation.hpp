// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "evaluation/cell_judge.hpp"
#include "evaluation/clearance_trial.hpp"
#include "evaluation/map_judge.hpp"

namespace crane {

/// All that is found out by comparing a map with the truth.
struct Evaluation {
  Judgement columns;
  CellJudgement cells;
  ClearanceTrial clearance;
};

Evaluation evaluate(const JudgedMap& map, const TrueSolids& truth,
                    const ClearanceTrialOptions& queries = {});

/// Lines for people: cells, each obstacle, queries with the place of the first wrong answer.
std::string cell_report(const CellJudgement& cells);
std::string clearance_report(const ClearanceTrial& trial);

}  // namespace crane
