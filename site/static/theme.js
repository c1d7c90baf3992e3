// Runs before the first paint: the reader's choice of light or dark, else the system's.
(function () {
  "use strict";
  var chosen = null;
  try { chosen = localStorage.getItem("theme"); } catch (error) { /* no storage here: follow the system */ }
  var system = matchMedia("(prefers-color-scheme: dark)");
  function apply() { document.documentElement.dataset.theme = chosen || (system.matches ? "dark" : "light"); }
  apply();
  system.addEventListener("change", function () { apply(); document.dispatchEvent(new Event("theme")); });
  document.addEventListener("DOMContentLoaded", function () {
    var button = document.getElementById("theme");
    if (!button) { return; }
    button.hidden = false;
    button.addEventListener("click", function () {
      chosen = document.documentElement.dataset.theme === "dark" ? "light" : "dark";
      try { localStorage.setItem("theme", chosen); } catch (error) { /* the choice lasts for this page */ }
      apply();
      document.dispatchEvent(new Event("theme"));
    });
  });
})();
