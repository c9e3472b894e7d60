#include "systems/particles/spring_memory.hpp"
#include "physics/pair/springs/mixed.hpp"

namespace bs {

PetscErrorCode SpringMemory::create(Network& net, const Rows& rows) {
  PetscFunctionBegin;
  net_ = &net;
  if (!net.mixed) PetscFunctionReturn(0);
  for (const SpringHistory& history : spring_histories()) {
    const std::string name = history.name;
    Number number{name, history.powers, std::vector<int>(spring_laws().size(), -1), {}};
    bool carried = false;
    for (std::size_t law = 0; law < spring_laws().size(); ++law) {
      const SpringLawInfo& info = spring_laws()[law];
      for (std::size_t k = 0; k < info.history.size(); ++k)
        if (net.laws[law] && name == info.history[k].name) {
          number.place[law] = static_cast<int>(info.parameters.size() + k);
          carried = true;
        }
    }
    if (carried) numbers_.push_back(std::move(number));
  }
  if (active()) PetscCall(table_.create(net, rows));
  PetscFunctionReturn(0);
}

double* SpringMemory::find(const Number& number, PetscInt link) const {
  Links& links = net_->links;
  const int place = number.place[links.law[link]];
  return place < 0 ? nullptr : links.more.data() + static_cast<std::size_t>(link) * links.width + place;
}

PetscErrorCode SpringMemory::gather(std::vector<StatePart>* parts) {
  PetscFunctionBegin;
  for (Number& number : numbers_) {
    const auto value = [&](PetscInt, PetscInt link) {
      const double* at = find(number, link);
      return at ? *at : 0.0;
    };
    PetscCall(table_.gather(value, &number.rows));
    parts->push_back({number.name, number.rows});
  }
  PetscFunctionReturn(0);
}

PetscErrorCode SpringMemory::fields(std::vector<Field>* out) {
  std::vector<StatePart> parts;
  PetscFunctionBegin;
  PetscCall(gather(&parts));
  for (const Number& number : numbers_) out->push_back({"/backspring/" + number.name, number.rows, true, {}, false, false, number.powers});
  PetscFunctionReturn(0);
}

PetscErrorCode SpringMemory::scatter() {
  PetscFunctionBegin;
  for (const Number& number : numbers_)
    PetscCall(table_.spread(number.rows, [&](PetscInt link, double value) {
      if (double* at = find(number, link)) *at = value;
    }));
  PetscFunctionReturn(0);
}

PetscErrorCode SpringMemory::accept(double t) {
  std::vector<StatePart> parts;
  PetscFunctionBegin;
  net_->links.history_time = t;
  if (!net_->box.active()) PetscFunctionReturn(0);
  PetscCall(gather(&parts));
  PetscCall(scatter());
  PetscFunctionReturn(0);
}

// half a spring from either end
double SpringMemory::dissipated() const {
  double energy = 0;
  if (!active()) return energy;
  const Links& links = net_->links;
  for (std::size_t e = 0; e < links.law.size(); ++e)
    if (links.spring[e] >= 0)
      energy += 0.5 * MixedSpring::dissipated(links.stiffness[e], {links.law[e], links.more.data() + e * static_cast<std::size_t>(links.width)});
  return energy;
}

void SpringMemory::keep(const Keeper& keep) {
  if (active() && net_->relaxes) keep("springs/history_time", net_->links.history_time, net_->links.history_time);
}

}  // namespace bs
