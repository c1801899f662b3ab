// The search reads a dash before a word as "pages without this word", and splits queries at dashes, but options such as
// --decision-steps are words of its index (mkdocs.yml). This replaces an option in a query by a pattern, which also
// matches the key decision_steps, on the query's way to the search's worker.
const post = Worker.prototype.postMessage;
Worker.prototype.postMessage = function (message, ...rest) {
  const asPattern = (_, space, name) => space + name.replaceAll("-", "*");
  const isQuery = typeof message?.data === "string";
  return post.call(this, isQuery ? { ...message, data: message.data.replace(/(^|\s)--([\w-]+)/g, asPattern) } : message, ...rest);
};
