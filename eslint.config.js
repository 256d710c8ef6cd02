import js from "@eslint/js";
import globals from "globals";

export default [
  { ignores: ["reports/templates/page/d3.js"] },
  { ...js.configs.recommended, files: ["reports/templates/page/*.js"] },
  {
    files: ["reports/templates/page/*.js"],
    languageOptions: { globals: globals.browser },
    rules: { "prefer-const": "error", "no-var": "error", eqeqeq: "error", "max-lines": ["error", 250] },
  },
];
