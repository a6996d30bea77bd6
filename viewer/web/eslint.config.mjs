// For ESLint (npm): scripts/check-web runs it where it is installed. Rules that find mistakes, and the few of layout that people forget.
const browser = ["window", "document", "navigator", "location", "console", "performance", "devicePixelRatio", "innerWidth",
  "innerHeight", "requestAnimationFrame", "setTimeout", "clearTimeout", "addEventListener", "fetch", "createImageBitmap", "atob", "Blob",
  "Response", "URL", "Worker", "TextDecoder", "TextEncoder", "DecompressionStream", "OffscreenCanvas", "XRWebGLLayer",
  "WebGL2RenderingContext", "EventTarget", "Event"];
const node = ["process", "Buffer", "console", "URL", "setTimeout", "performance"];
const globals = (names) => Object.fromEntries(names.map((name) => [name, "readonly"]));

const rules = {
  "array-callback-return": "error", "constructor-super": "error", "eqeqeq": "error", "for-direction": "error", "getter-return": "error",
  "no-async-promise-executor": "error", "no-class-assign": "error", "no-compare-neg-zero": "error", "no-cond-assign": "error",
  "no-const-assign": "error", "no-constant-binary-expression": "error", "no-constant-condition": "error", "no-constructor-return": "error",
  "no-debugger": "error", "no-dupe-args": "error", "no-dupe-class-members": "error", "no-dupe-else-if": "error", "no-dupe-keys": "error",
  "no-duplicate-case": "error", "no-duplicate-imports": "error", "no-empty-pattern": "error", "no-fallthrough": "error",
  "no-func-assign": "error", "no-import-assign": "error", "no-loss-of-precision": "error", "no-new-native-nonconstructor": "error",
  "no-obj-calls": "error", "no-redeclare": "error", "no-self-assign": "error",
  "no-self-compare": "error",
  "no-setter-return": "error", "no-sparse-arrays": "error", "no-this-before-super": "error", "no-undef": "error", "no-unreachable": "error",
  "no-unreachable-loop": "error", "no-unsafe-finally": "error", "no-unsafe-negation": "error", "no-unsafe-optional-chaining": "error",
  "no-unused-private-class-members": "error", "no-unused-vars": "error", "no-use-before-define": ["error", { functions: false }],
  "no-useless-assignment": "error", "no-var": "error", "prefer-const": ["error", { destructuring: "all" }], "require-yield": "error",
  "use-isnan": "error", "valid-typeof": "error",
};

export default [
  { files: ["**/*.js"], languageOptions: { ecmaVersion: 2023, sourceType: "module", globals: globals(browser) }, rules },
  // Those that drive a browser have functions that run in it.
  {
    files: ["**/*.mjs", "scripts/*"],
    languageOptions: { ecmaVersion: 2023, sourceType: "module", globals: globals([...browser, ...node]) }, rules,
  },
];
