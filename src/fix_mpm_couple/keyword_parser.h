/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Reads the words of a fix command. Every error names the style and id of the fix, the keyword, what was given and what
 * is allowed. All ranks read the same words, so that all of them meet the same error. */
#ifndef LMP_KEYWORD_PARSER_H
#define LMP_KEYWORD_PARSER_H

#include <cstdint>
#include <set>
#include <string>
#include <vector>

#include "pointers.h"

namespace LAMMPS_NS {

class Fix;

/* The numbers that a keyword takes. Not-a-number and infinity are never among them. */
struct NumberRange {
  double low, high;
  bool open_low, open_high; /* the limit itself is not allowed */
  std::string text() const; /* "a number > 0" */
  static NumberRange any();
  static NumberRange positive();
  static NumberRange at_least(double low);
  static NumberRange between(double low, double high);
  static NumberRange inside(double low, double high);     /* both limits excluded */
  static NumberRange from_below(double low, double high); /* low <= x < high */
};

class KeywordParser : protected Pointers {
 public:
  /* Words arg[first..narg) of `fix`; `keywords` are all that the command knows. */
  KeywordParser(LAMMPS *lmp, const Fix *fix, int narg, char **arg, int first, const std::vector<std::string> &keywords);

  /* Goes on to the next keyword; false at the end. Refuses unknown and repeated ones. */
  bool next();
  bool is(const char *keyword) const { return keyword_ == keyword; }
  bool given(const char *keyword) const { return seen_.count(keyword) > 0; }

  /* Values of the present keyword. */
  double number(const NumberRange &range);
  /* others: what else is allowed, for the message. */
  int integer(int low, int high, const char *others = "");
  int64_t long_integer(int64_t low, int64_t high, const char *others = "");
  std::string word(const std::string &allowed);
  int choice(const std::vector<std::string> &words); /* its index */
  bool yes_no();
  /* A number, or the word INF: -infinity or infinity by `sign`. */
  double number_or_infinity(int sign);
  /* True and passed by if the next word is `word`. */
  bool accept(const char *word);
  /* True if there is a next word and it is no keyword. */
  bool has_value() const;

  /* Ends the program unless the keyword was given; `usage` says how to. */
  void require(const char *keyword, const char *usage) const;
  /* Ends the program if both keywords were given. */
  void exclude(const char *one, const char *other) const;
  /* Ends the program with a message about the present keyword. */
  [[noreturn]] void refuse(const std::string &given, const std::string &allowed) const;
  [[noreturn]] void fail(const std::string &message) const;

 private:
  const Fix *fix_;
  std::vector<std::string> words_;
  size_t position_;
  std::vector<std::string> keywords_;
  std::set<std::string> seen_;
  std::string keyword_;

  const std::string &take(const std::string &allowed);
  bool is_keyword(const std::string &word) const;
};

/* "a, b or c" */
std::string join_words(const std::vector<std::string> &words);

}  // namespace LAMMPS_NS

#endif
