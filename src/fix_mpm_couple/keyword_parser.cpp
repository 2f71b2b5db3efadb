/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "keyword_parser.h"

#include <cerrno>
#include <cmath>
#include <cstdlib>

#include "rank_error.h"

using namespace LAMMPS_NS;

static std::string short_number(double x) {
  char text[32];
  snprintf(text, sizeof text, "%g", x);
  return text;
}

NumberRange NumberRange::any() { return {-HUGE_VAL, HUGE_VAL, true, true}; }
NumberRange NumberRange::positive() { return {0.0, HUGE_VAL, true, true}; }
NumberRange NumberRange::at_least(double low) { return {low, HUGE_VAL, false, true}; }
NumberRange NumberRange::between(double low, double high) { return {low, high, false, false}; }
NumberRange NumberRange::inside(double low, double high) { return {low, high, true, true}; }
NumberRange NumberRange::from_below(double low, double high) { return {low, high, false, true}; }

std::string NumberRange::text() const {
  const bool has_low = !std::isinf(low), has_high = !std::isinf(high);
  if (!has_low && !has_high) return "a finite number";
  std::string result = "a number ";
  if (has_low) result += std::string(open_low ? "> " : ">= ") + short_number(low);
  if (has_low && has_high) result += " and ";
  if (has_high) result += std::string(open_high ? "< " : "<= ") + short_number(high);
  return result;
}

std::string LAMMPS_NS::join_words(const std::vector<std::string> &words) {
  std::string result;
  for (size_t k = 0; k < words.size(); k++) result += (k == 0 ? "" : k + 1 == words.size() ? " or " : ", ") + words[k];
  return result;
}

KeywordParser::KeywordParser(LAMMPS *lammps, const Fix *fix, int narg, char **arg, int first,
                             const std::vector<std::string> &keywords)
    : Pointers(lammps), fix_(fix), position_(0), keywords_(keywords) {
  for (int k = first; k < narg; k++) words_.push_back(arg[k]);
}

bool KeywordParser::is_keyword(const std::string &word) const {
  for (const std::string &keyword : keywords_)
    if (keyword == word) return true;
  return false;
}

bool KeywordParser::next() {
  if (position_ == words_.size()) return false;
  const std::string word = words_[position_++];
  if (!is_keyword(word)) fail("unknown keyword '" + word + "', allowed are: " + join_words(keywords_));
  keyword_ = word;
  if (!seen_.insert(word).second) fail("keyword '" + word + "' is given twice");
  return true;
}

const std::string &KeywordParser::take(const std::string &allowed) {
  if (position_ == words_.size()) refuse("", allowed);
  return words_[position_++];
}

/* strtod also reads nan, inf, hexadecimal numbers and leading blanks: none of them is wanted in a script. */
static bool read_number(const std::string &text, double &value) {
  if (text.empty() || text.find_first_not_of("0123456789+-.eE") != std::string::npos) return false;
  char *end;
  value = strtod(text.c_str(), &end);
  return *end == '\0' && std::isfinite(value);
}

double KeywordParser::number(const NumberRange &range) {
  const std::string text = take(range.text());
  double value;
  if (!read_number(text, value)) refuse(text, range.text());
  if (value < range.low || value > range.high || (range.open_low && value == range.low) ||
      (range.open_high && value == range.high))
    refuse(text, range.text());
  return value;
}

int64_t KeywordParser::long_integer(int64_t low, int64_t high, const char *others) {
  const std::string allowed = others + std::string("a whole number from ") + std::to_string(low) + " to " + std::to_string(high);
  const std::string text = take(allowed);
  if (text.empty() || text.find_first_not_of("0123456789+-") != std::string::npos) refuse(text, allowed);
  char *end;
  errno = 0;
  const long long value = strtoll(text.c_str(), &end, 10);
  if (*end != '\0' || errno != 0 || value < low || value > high) refuse(text, allowed);
  return value;
}

int KeywordParser::integer(int low, int high, const char *others) { return (int)long_integer(low, high, others); }

std::string KeywordParser::word(const std::string &allowed) {
  const std::string text = take(allowed);
  if (text.empty()) refuse(text, allowed);
  return text;
}

int KeywordParser::choice(const std::vector<std::string> &words) {
  const std::string allowed = join_words(words), text = take(allowed);
  for (size_t k = 0; k < words.size(); k++)
    if (words[k] == text) return (int)k;
  refuse(text, allowed);
}

bool KeywordParser::yes_no() { return choice({"no", "yes"}) == 1; }

double KeywordParser::number_or_infinity(int sign) {
  if (accept("INF")) return sign * HUGE_VAL;
  const std::string allowed = "a finite number or INF", text = take(allowed);
  double value;
  if (!read_number(text, value)) refuse(text, allowed);
  return value;
}

bool KeywordParser::accept(const char *word) {
  if (position_ == words_.size() || words_[position_] != word) return false;
  position_++;
  return true;
}

bool KeywordParser::has_value() const { return position_ < words_.size() && !is_keyword(words_[position_]); }

void KeywordParser::require(const char *keyword, const char *usage) const {
  if (!given(keyword)) fail(std::string("keyword '") + keyword + "' is missing: " + usage);
}

void KeywordParser::exclude(const char *one, const char *other) const {
  if (given(one) && given(other))
    fail(std::string("keywords '") + one + "' and '" + other + "' cannot be given together");
}

void KeywordParser::refuse(const std::string &given, const std::string &allowed) const {
  const std::string what = given.empty() ? "a value is missing" : "'" + given + "' is given";
  fail((keyword_.empty() ? "" : "keyword '" + keyword_ + "': ") + what + ", allowed is " + allowed);
}

void KeywordParser::fail(const std::string &message) const { fix_failed(lmp, fix_, message); }
