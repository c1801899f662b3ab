// Common parts of the replay page and the gallery.

const byId = id => document.getElementById(id);
function make(tag, text, name) {
  const element = document.createElement(tag);
  if (text !== undefined) element.textContent = text;
  if (name) element.className = name;
  return element;
}

// Name of a policy: its file, or its run, since checkpoints of all runs have the same name.
function policyName({ policy }) {
  const names = policy.split("/"), isOfRun = /^(checkpoint|policy)\./.test(names.at(-1)) && names.length > 1;
  return names.at(isOfRun ? -2 : -1);
}
// Name of a world. Evaluations number the worlds of a map from 2^31, all with one seed.
const FIRST_SCENARIO = 2 ** 31;
const worldName = header => header.global_world >= FIRST_SCENARIO ? `scenario ${header.global_world - FIRST_SCENARIO}` : `seed ${header.seed}`;
