// What the linter asks of the page's script. It runs where report.sh has installed it.
import js from "@eslint/js";
import globals from "globals";

export default [
  js.configs.recommended,
  {
    files: ["lint/**/*.js"],
    languageOptions: { ecmaVersion: 2023, sourceType: "module", globals: globals.browser },
    rules: {
      "no-unused-vars": "error", "no-undef": "error", "no-shadow": ["error", { builtinGlobals: false }], "no-var": "error", "prefer-const": "error",
      eqeqeq: "error", "no-implicit-globals": "error", "no-eval": "error", "no-implied-eval": "error", "consistent-return": "error",
      "no-duplicate-imports": "error", "max-lines": ["error", 350], "max-len": ["error", 120], complexity: ["error", 20],
    },
  },
];
